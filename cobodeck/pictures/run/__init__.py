"""The picture of a whole run, from its record."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
