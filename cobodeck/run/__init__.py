"""Runs, simulated and real, from options to summary."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
