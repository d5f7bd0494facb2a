"""Writing a record while a run goes on, and recovering one that was cut off."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
