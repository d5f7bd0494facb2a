"""What files say about a robot: base, arm, prop, sensors, trackers, calibration."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
