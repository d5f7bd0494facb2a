"""Pictures of charts."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
