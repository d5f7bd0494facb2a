"""Files checked and described: checks of each kind of file, schemas for editors."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
