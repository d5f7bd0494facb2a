"""The person: where they may walk, and what that means for a place or a drive of the robot."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
