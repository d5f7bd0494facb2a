"""Campaigns: many runs over all combinations of settings, people and seeds."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
