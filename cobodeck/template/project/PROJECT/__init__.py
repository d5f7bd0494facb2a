"""Charts and states of one's own."""
