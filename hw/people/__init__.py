"""People: simulated, scripted, recorded and live."""
