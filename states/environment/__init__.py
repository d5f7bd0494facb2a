"""What states of all abilities share: the environment of a run, signal names, poses now."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
