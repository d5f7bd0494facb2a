"""Where the user may walk next, and what that means for a place of the robot."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
