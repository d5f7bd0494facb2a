"""Kinds of YAML files, declared once: records with typed values, units, ranges and names."""
