"""Is all fit to run: what a check is, and the one list of checks."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
