"""What tests of charts and states use."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
