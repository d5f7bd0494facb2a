"""SICK S300 scanners."""
