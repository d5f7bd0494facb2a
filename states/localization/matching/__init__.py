"""Scans matched to a map: tracking, global search, particles, and the health of a match."""
