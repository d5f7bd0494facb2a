"""Static checks of charts, before anything moves: the list of all, and each of them."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
