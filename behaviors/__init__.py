"""CoboDeck's own decisions and the states that take them."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
