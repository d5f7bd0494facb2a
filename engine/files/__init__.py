"""Reader of YAML files with places, units and ranges; independent of charts and robots."""
