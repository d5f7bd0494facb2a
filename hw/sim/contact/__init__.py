"""Who touches whom in the simulated world, and how fast both were."""
