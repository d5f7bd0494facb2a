"""A fake UR controller (CB3) with RTDE."""
