"""Costmaps, planners on grids, and obstacles from scans."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
