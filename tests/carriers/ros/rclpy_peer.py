"""A program of ROS 2 by rclpy: publish so many numbers in a burst, and receive as many.

Its subscriber keeps all; its publisher has the depth that is given. Both are reliable. It begins
when both are matched and a line comes: before, the other side may not have matched them.
"""

# mypy: disable-error-code="import-not-found"

import sys
import threading
import time

import rclpy
from rclpy.qos import QoSProfile
from std_msgs.msg import UInt32

count, depth = map(int, sys.argv[1:])
rclpy.init()
node = rclpy.create_node("lens")
numbers: list[int] = []
looks = node.create_subscription(
    UInt32, "/look", lambda each: numbers.append(each.data), QoSProfile(depth=count)
)
judged = node.create_publisher(UInt32, "/judged", QoSProfile(depth=depth))
thread = threading.Thread(target=rclpy.spin, args=(node,), daemon=True)
thread.start()
while not (looks.get_publisher_count() and judged.get_subscription_count()):
    time.sleep(0.01)
sys.stdout.write("ready\n")
sys.stdout.flush()
sys.stdin.readline()
for number in range(count):
    judged.publish(UInt32(data=number))
end = time.monotonic() + 60
while len(numbers) < count and time.monotonic() < end:
    time.sleep(0.01)
time.sleep(0.2)
sys.stdout.write(f"{len(numbers)} {numbers == list(range(count))}\n")
sys.stdout.flush()
sys.stdin.readline()
rclpy.shutdown()
