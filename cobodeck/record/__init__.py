"""One record per run (MCAP): what flowed, to be looked at, replayed and compared."""
