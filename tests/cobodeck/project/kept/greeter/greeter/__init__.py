"""Your own charts and states."""
