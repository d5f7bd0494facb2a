"""What a server shows: a run while it goes on, or records."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
