"""A node of fsmkit with services and a life; a client of rclpy calls them and prints what comes."""

# mypy: disable-error-code="import-not-found, import-untyped"

import sys
import time
from itertools import count
from typing import Any

import rclpy
from lifecycle_msgs.srv import ChangeState
from std_srvs.srv import SetBool, Trigger

import fsmkit
from fsmkit.runtime.node import Node
from fsmkit.system.deployment.deployment import Deployment

deployment = fsmkit.read(sys.argv[1])
assert isinstance(deployment, Deployment)
rclpy.init()
client = rclpy.create_node("client")
with Node(deployment, "b", session=1) as node:
    times = count()

    def call(type_: Any, name: str, request: Any) -> Any:
        ends = client.create_client(type_, name)
        end = time.monotonic() + 30
        future = None
        while future is None or not future.done():
            assert time.monotonic() < end, f"{name} does not answer"
            if future is None and ends.service_is_ready():
                future = ends.call_async(request)
            node.cycle(next(times))
            rclpy.spin_once(client, timeout_sec=0.005)
        return future.result()

    def say(*what: object) -> None:
        sys.stdout.write(" ".join(map(str, (*what, *node.machines.active("camera")))) + "\n")

    asked = call(SetBool, "/cell/camera/focus", SetBool.Request(data=True))
    say(asked.success, asked.message)
    for transition in (1, 3):  # configure, activate
        move = ChangeState.Request()
        move.transition.id = transition
        say(call(ChangeState, "/cell/b/change_state", move).success)
    asked = call(SetBool, "/cell/camera/focus", SetBool.Request(data=True))
    say(asked.success, asked.message)
    asked = call(Trigger, "/cell/camera/count", Trigger.Request())
    say(asked.success, asked.message)
    move = ChangeState.Request()
    move.transition.id = 4  # deactivate
    say(call(ChangeState, "/cell/b/change_state", move).success)
rclpy.shutdown()
