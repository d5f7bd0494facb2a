"""The safety chain in a process of its own."""
