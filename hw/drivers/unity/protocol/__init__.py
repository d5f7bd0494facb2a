"""The ROS-TCP-Connector protocol as bytes, messages, topics and sessions."""
