"""Costmaps, planners on grids, and obstacles from scans."""
