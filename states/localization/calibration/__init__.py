"""Calibration of the trackers: hand-eye transforms from pose pairs."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
