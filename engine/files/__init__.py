"""Reads YAML files with places, units and ranges; knows neither charts nor robots."""
