"""Benchmarks of localization: simulated drives, real logs, peers."""
