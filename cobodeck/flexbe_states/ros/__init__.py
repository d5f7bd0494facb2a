"""What FlexBE states find in place of ROS: modules, time, messages, topics."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
