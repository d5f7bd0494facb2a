"""The ROS-TCP-Connector protocol as bytes, messages, topics and sessions."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
