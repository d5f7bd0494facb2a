"""Drivers of real devices; vendor libraries are imported in here only."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
