"""A project: its folder, its files, its own code, and the catalogue of all states."""
