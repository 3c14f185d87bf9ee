"""The carrier of ROS 2: joins a link with a foreign node by DDS."""
