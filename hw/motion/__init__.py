"""Motion from stamped poses: where something was, where it is now, how fast it moves."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
