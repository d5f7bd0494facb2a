"""What files say about a robot: base, arm, prop, sensors, trackers, calibration."""
