"""Where the arm's links are, what reaches a pose, and what touches what."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
