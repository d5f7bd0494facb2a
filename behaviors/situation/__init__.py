"""What a behaviour decides on: the present situation, and the Chase space."""
