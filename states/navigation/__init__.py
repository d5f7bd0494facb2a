"""Where to drive and how to get there."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
