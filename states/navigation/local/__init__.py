"""Following a path: speed profile, timed elastic band, and the drive that runs them."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
