"""Fake devices that speak the real protocols, with faults on demand."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
