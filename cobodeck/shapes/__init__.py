"""What is seen of a room from above, as shapes in the map: for pictures and for the live page."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
