"""Where to drive and how to get there."""
