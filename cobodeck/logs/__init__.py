"""Recorded sensor logs of several kinds, read as one stream of samples."""
