"""The robot, the room and the people in it."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
