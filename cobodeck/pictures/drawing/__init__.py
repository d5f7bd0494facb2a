"""What all pictures of a room are drawn with: canvas, labels, room, people, robot."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
