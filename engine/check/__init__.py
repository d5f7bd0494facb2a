"""Static checks of charts, and their exploration, before anything moves."""
