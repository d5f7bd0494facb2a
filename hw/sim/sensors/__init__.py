"""Simulated sensors: what is measured, how late, and how wrong."""
