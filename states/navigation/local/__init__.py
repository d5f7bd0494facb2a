"""Following a path: speed profile, timed elastic band, and the drive that runs them."""
