"""JSON Schema of chart files, for editors."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
