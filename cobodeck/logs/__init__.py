"""Recorded sensor logs of several formats, each read as one stream of samples."""
