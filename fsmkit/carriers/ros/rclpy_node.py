"""Nodes of rclpy, for features that Cyclone DDS lacks: services, the lifecycle of a node.

rclpy is part of an installation of ROS 2, or of ``ros-rclpy[fastrtps]`` for CPython 3.11.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from types import MappingProxyType
from typing import Any

from fsmkit.carriers.ros.messages import lower
from fsmkit.diagnostics import fail

RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"


class RclpyNode:
    """A node in a context of rclpy of its own; it makes progress in `spin` only.

    Raises:
        FsmkitError: ``missing-package`` without rclpy; ``link-not-opened``.

    """

    def __init__(
        self,
        name: str,
        *,
        namespace: str = "",
        domain: int | None = None,
        is_insecure: bool = True,
        life: Mapping[str, int] = MappingProxyType({}),
        moved: Callable[[int], object] = int,
    ) -> None:
        """Create a node; with a lifecycle, ``moved`` is called with each transition's number."""
        rclpy: Any = import_ros_module("rclpy")
        import_ros_module("rclpy.executors")
        self._rclpy = rclpy
        self._context = rclpy.Context()
        try:
            with _confined(is_insecure=is_insecure):
                rclpy.init(context=self._context, domain_id=domain)
            make = _lifecycle_class(life, moved) if life else import_ros_module("rclpy.node").Node
            self.node: Any = make(lower(name), context=self._context, namespace=namespace)
            self._executor = rclpy.executors.SingleThreadedExecutor(context=self._context)
            self._executor.add_node(self.node)
        except RuntimeError as error:
            raise fail(
                "link-not-opened",
                f"rclpy cannot create the node `{name}`: {error}",
                help="see ROS_DOMAIN_ID and RMW_IMPLEMENTATION",
            ) from error

    def package(self, name: str) -> Any:
        """Return a module of a package with messages or services."""
        return import_ros_module(name)

    def spin(self) -> None:
        """Process ready events; does not block."""
        self._executor.spin_once(timeout_sec=0)

    def leave(self) -> None:
        """Destroy the node and its context."""
        if self.node is not None:
            self._executor.shutdown(timeout_sec=0)
            self.node.destroy_node()
            self.node = None
            self._rclpy.shutdown(context=self._context)


@contextmanager
def _confined(*, is_insecure: bool) -> Iterator[None]:
    """Confine rclpy to this computer by its environment, unless it is insecure."""
    before = os.environ.get(RANGE)
    if not is_insecure:
        os.environ[RANGE] = "LOCALHOST"
    try:
        yield
    finally:
        if before is None:
            os.environ.pop(RANGE, None)
        else:
            os.environ[RANGE] = before


def _lifecycle_class(life: Mapping[str, int], moved: Callable[[int], object]) -> Any:
    """Return a class of nodes with a lifecycle, whose transitions all succeed."""
    found = import_ros_module("rclpy.lifecycle")

    def followed(number: int) -> Callable[[Any, Any], Any]:
        def follow(node: Any, state: Any) -> Any:  # noqa: ARG001  (the protocol of rclpy)
            moved(number)
            return found.TransitionCallbackReturn.SUCCESS

        return follow

    methods = {f"on_{transition}": followed(number) for transition, number in life.items()}
    return type("LivingNode", (found.LifecycleNode,), methods)


def import_ros_module(name: str) -> Any:
    """Return a module of ROS. Raises `FsmkitError` if it is not installed."""
    try:
        return import_module(name)
    except ImportError as error:
        package = name.partition(".")[0]
        raise fail(
            "missing-package",
            f"`way: rclpy` needs `{package}`: {error}",
            help="install ROS 2 and source its setup file, or pip install 'ros-rclpy[fastrtps]'; "
            "messages of your system come from `fsmkit compile --package ros2` and colcon",
        ) from error
