"""A Unity project through the ROS-TCP-Connector."""
