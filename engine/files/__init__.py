"""YAML files with places, units, ranges; values as JSON; independent of charts and robots."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
