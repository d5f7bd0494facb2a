"""The robot moved by MuJoCo: the reference that the other tiers are judged by."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
