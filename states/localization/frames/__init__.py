"""Frames and the transforms between them over time."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
