"""Maps from drives: incremental mapping, loop closure, pose graph."""
