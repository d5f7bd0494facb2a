"""A chart made ready to run: its nodes, and where the end of each of them leads."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
