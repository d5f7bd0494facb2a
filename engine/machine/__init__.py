"""A chart made ready to run: its nodes, where each of them leads, and all that it can come to."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
