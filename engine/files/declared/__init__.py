"""Kinds of YAML files, declared once: records with typed values, units, ranges and names."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
