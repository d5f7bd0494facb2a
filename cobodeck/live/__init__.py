"""The live page: charts, runs and records seen and steered in a browser, or in a terminal."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
