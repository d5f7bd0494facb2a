"""Joint paths and their timing under joint, tool and link limits."""
