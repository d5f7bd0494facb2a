"""Occupancy maps: files, cells, distance fields, and maps from scans."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
