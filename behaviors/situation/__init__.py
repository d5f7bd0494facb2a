"""What a behaviour decides on: the present situation, and the Chase space."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
