"""A self-built base on a CAN bus."""
