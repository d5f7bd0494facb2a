"""Maps from drives: incremental mapping, loop closure, pose graph."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
