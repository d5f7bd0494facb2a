"""Log files of others: CARMEN, rosbag, MRPT, and our own records as logs."""
