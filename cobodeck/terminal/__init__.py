"""The terminal: everything printed, and the types of command-line arguments."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
