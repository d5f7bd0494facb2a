"""Which driver serves which part of a robot: connection files."""
