"""Behaviours converted to charts and the state classes that these need."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
