"""Exact shortest paths among inflated polygons."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
