"""Motion from stamped poses: where something was, where it is now, how fast it moves."""
