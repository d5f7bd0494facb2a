"""People who walk by themselves: scripts, pedestrians, wanderers, and their manners."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
