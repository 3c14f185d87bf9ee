"""ROS 2: topics and services of foreign nodes, and topics that carry frames between nodes.

`messages` assigns each type of the action language a type of ROS. `link` and `translator` use
Cyclone DDS, `rclpy_translator` rclpy; the C in ``c`` uses Cyclone DDS or rclc.
"""
