"""Log files as drives: CARMEN, ROS bags, and our own records."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
