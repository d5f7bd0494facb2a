"""Recorded sensor logs of several formats, each read as one stream of samples."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
