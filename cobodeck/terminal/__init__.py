"""The terminal: everything printed, and the types of command-line arguments."""
