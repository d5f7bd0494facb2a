"""Statistics of runs: rank tests, and bounds of proportions and means."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
