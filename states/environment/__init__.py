"""What states of all abilities share: the environment of a run, signal names, poses now."""
