"""Reading a record: replay, comparison, its person and its plant."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
