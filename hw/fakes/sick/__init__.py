"""Fake safety laser scanners."""
