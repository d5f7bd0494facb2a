"""How much of a floor a robot can use: areas, closed passages, user poses."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
