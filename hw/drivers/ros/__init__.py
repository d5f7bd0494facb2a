"""What comes from a ROS through rosbridge."""
