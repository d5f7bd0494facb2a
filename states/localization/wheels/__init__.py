"""Motion from wheels and gyro, and how far to trust it."""
