"""A fake VR application that speaks the ROS-TCP-Connector protocol."""
