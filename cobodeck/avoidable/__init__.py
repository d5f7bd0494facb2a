"""Could a contact or a failed Escape have been avoided: a search apart from the behaviours."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
