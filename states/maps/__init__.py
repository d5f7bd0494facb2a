"""Maps of rooms: files, cells and distances, for planners and for localization."""
