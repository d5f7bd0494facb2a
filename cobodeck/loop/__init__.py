"""The one loop: wiring, samples to signals, the plant, ticks, clocks."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
