"""Benchmarks of the arm, beside peers."""
