"""Signals: the kinds there are, their current values on a board, and the log of events."""
