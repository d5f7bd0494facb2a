"""What all pictures of a room are drawn with: canvas, labels, room, people, robot."""
