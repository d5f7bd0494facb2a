"""People who repeat what was recorded: walks from files, users of earlier runs."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
