"""One record per run (MCAP) of everything that flowed, for viewing, replay and comparison."""
