"""A real robot: opening connections, preflight, release stages, health."""
