"""Abilities: plain algorithms, and one states.py in each folder."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
