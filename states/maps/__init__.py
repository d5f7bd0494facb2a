"""Occupancy maps: files, cells, distance fields, and maps from scans."""
