"""States that watch any signal, named by a parameter."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
