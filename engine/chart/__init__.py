"""A chart as it is written: read from YAML into vertices, with the place of each word."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
