"""The world of a run: room, zones, objects, and the scene file that joins them."""
