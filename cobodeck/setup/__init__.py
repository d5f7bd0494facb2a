"""What a run is made of before it starts: scene, options, compiled code, checks."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
