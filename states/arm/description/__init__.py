"""Arms read from URDF and from robot files."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
