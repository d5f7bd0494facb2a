"""Is this machine, room, robot, chart fit to run: the checks and who asks them."""
