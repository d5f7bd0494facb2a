"""Static checks of charts, and their exploration, before anything moves."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
