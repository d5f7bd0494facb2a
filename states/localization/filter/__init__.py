"""Kalman filters: prediction, gates and fusion of stamped measurements."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
