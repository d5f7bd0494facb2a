"""What an operator can do to a run: stop, pause, force, lock, replace."""
