"""Who touches whom in the simulated world, and how fast both were."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
