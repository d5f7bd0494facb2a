"""Frames and the transforms between them over time."""
