"""Behaviours of FlexBE, read and converted to charts of a project that works on its own."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
