"""The estimator of the cell as a program of its own, over ROS 2."""
