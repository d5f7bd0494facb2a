"""Drivers of real devices; vendor libraries are imported in here only."""
