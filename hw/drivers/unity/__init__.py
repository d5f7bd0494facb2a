"""The VR application: a Unity project through the ROS-TCP-Connector."""
