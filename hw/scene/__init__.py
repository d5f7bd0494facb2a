"""The world of a run: room, zones, objects, items, and the scene file that joins them."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
