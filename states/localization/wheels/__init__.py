"""Motion from wheels and gyro, and how far to trust it."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
