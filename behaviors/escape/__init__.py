"""Escape: trigger and end, poses and what is predicted for them, the states of both policies."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
