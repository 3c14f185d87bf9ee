"""A node of fsmkit publishes its diagnostics by rclpy; a subscriber of rclpy prints the first."""

# mypy: disable-error-code="import-not-found, import-untyped"

import sys
import time

import rclpy
from diagnostic_msgs.msg import DiagnosticArray

import fsmkit
from fsmkit.carriers.ros.diagnostics import Diagnostics
from fsmkit.runtime.node import Node
from fsmkit.system.deployment.deployment import Deployment

deployment = fsmkit.read(sys.argv[1])
assert isinstance(deployment, Deployment)
rclpy.init()
listener = rclpy.create_node("listener")
heard: list[DiagnosticArray] = []
listener.create_subscription(DiagnosticArray, "/diagnostics", heard.append, 10)
with (
    Node(deployment, "b", session=1) as node,
    Diagnostics(node, way="rclpy", period=0.05) as diagnostics,
):
    end = time.monotonic() + 30
    overruns = 0
    while not heard and time.monotonic() < end:
        node.cycle(0)
        diagnostics.update(overruns=overruns)
        overruns += 1
        rclpy.spin_once(listener, timeout_sec=0.01)
for status in heard[0].status:
    sys.stdout.write(f"{status.level} {status.name} {status.message}\n")
rclpy.shutdown()
