"""Settings of the behaviours, and the profiles that set them."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
