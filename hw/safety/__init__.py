"""The safety chain in front of the wheels, and the guarded base that drives behind it."""
