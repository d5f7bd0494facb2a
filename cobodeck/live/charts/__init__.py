"""Charts as pages see them: as messages, in a folder that is edited, started by a form."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
