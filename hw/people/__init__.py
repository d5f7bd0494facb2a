"""People: simulated, scripted, recorded and live."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
