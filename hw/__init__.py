"""The robot, the room and the people in it."""
