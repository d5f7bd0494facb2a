"""A chart as it is written: read from YAML into vertices, with the place of each word."""
