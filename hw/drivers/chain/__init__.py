"""The safety chain in a process of its own."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
