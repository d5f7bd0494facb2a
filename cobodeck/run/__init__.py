"""Runs, simulated and real, from options to summary."""
