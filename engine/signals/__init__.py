"""Signals: the kinds there are, their current values on a board, and the log of events."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
