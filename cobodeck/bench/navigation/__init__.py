"""Benchmarks of navigation: planners, drives under disturbance, decisions."""
