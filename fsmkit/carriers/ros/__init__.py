"""ROS 2: types of messages, their names in ROS and in DDS, and their definitions as text.

From here on each type of the action language has a primitive type of ROS that holds it.
"""
