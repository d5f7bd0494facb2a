"""State classes written for FlexBE: read without running them, and run as states of charts."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
