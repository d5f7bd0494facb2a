"""CoboDeck's own decisions and the states that take them."""
