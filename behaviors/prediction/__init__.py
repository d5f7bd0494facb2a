"""Where the user may walk next, and what that means for a place of the robot."""
