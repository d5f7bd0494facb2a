"""A real robot: opening connections, preflight, release stages, health."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
