"""Writing a record while a run goes on, and recovering one that was cut off."""
