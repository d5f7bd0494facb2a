"""Checks of what charts give: values, data, and names that values are."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
