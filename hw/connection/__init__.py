"""Which driver serves which part of a robot: connection files."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
