"""The simulated robot and room."""
