"""Chase: where to wait, how to keep out of the way, and the states of both policies."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
