"""Where the base is."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
