"""Scans matched to a map: tracking, global search, particles, and the health of a match."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
