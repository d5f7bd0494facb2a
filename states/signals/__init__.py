"""Signals derived from what the parts measure."""
