"""Kalman filters: prediction, gates and fusion of stamped measurements."""
