"""Simulated sensors: what is measured, how late, and how wrong."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
