"""Where the base is."""
