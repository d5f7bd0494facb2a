"""Benchmarks of the engine, beside peers."""
