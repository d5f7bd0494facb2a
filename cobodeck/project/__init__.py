"""A project: its folder, its files, its own code, and the catalogue of all states."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
