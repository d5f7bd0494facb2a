"""Behaviours read from generated Python, from JSON, and from whole folders."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
