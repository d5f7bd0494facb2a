"""A chart made ready to run: its nodes, and where the end of each of them leads."""
