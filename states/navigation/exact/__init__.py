"""Exact shortest paths among inflated polygons."""
