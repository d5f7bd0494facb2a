"""People who walk by themselves: scripts, pedestrians, wanderers, and their manners."""
