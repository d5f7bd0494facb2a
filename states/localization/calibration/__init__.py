"""Calibration of the trackers: hand-eye transforms from pose pairs."""
