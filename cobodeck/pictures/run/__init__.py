"""The picture of a whole run, from its record."""
