"""Reader of YAML files with places, units and ranges; independent of charts and robots."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
