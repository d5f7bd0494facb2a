"""Gripping, and feeling what the tool presses on: states alone."""
