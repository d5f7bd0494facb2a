"""Where the arm's links are, what reaches a pose, and what touches what."""
