"""Log files of others: CARMEN, rosbag, MRPT, and our own records as logs."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
