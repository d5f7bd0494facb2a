"""Collision-free arm motions, and what the arm can reach."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
