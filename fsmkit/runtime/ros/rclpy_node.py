"""Nodes of rclpy, for what Cyclone DDS alone cannot do: services, the life of a node.

rclpy is part of an installation of ROS 2, or comes as ``ros-rclpy[fastrtps]`` for CPython 3.11.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from fsmkit.diagnostics import fail
from fsmkit.ros.messages import lower


class RclpyNode:
    """A node in a context of rclpy of its own; it makes progress in `spin` only.

    Raises:
        FsmkitError: ``missing-package`` without rclpy; ``link-not-opened``.

    """

    def __init__(self, name: str, *, domain: int | None = None, has_life: bool = False) -> None:
        rclpy: Any = imported("rclpy")
        imported("rclpy.executors")
        self._rclpy = rclpy
        self._context = rclpy.Context()
        try:
            rclpy.init(context=self._context, domain_id=domain)
            make = imported("rclpy.lifecycle").LifecycleNode if has_life else rclpy.node.Node
            self.node: Any = make(lower(name), context=self._context)
            self._executor = rclpy.executors.SingleThreadedExecutor(context=self._context)
            self._executor.add_node(self.node)
        except RuntimeError as error:
            raise fail(
                "link-not-opened",
                f"rclpy cannot make the node `{name}`: {error}",
                help="see ROS_DOMAIN_ID and RMW_IMPLEMENTATION",
            ) from error

    def package(self, name: str) -> Any:
        """Return a module of a package with messages or services."""
        return imported(name)

    def spin(self) -> None:
        """Do what is ready; does not block."""
        self._executor.spin_once(timeout_sec=0)

    def leave(self) -> None:
        """Destroy the node and its context."""
        if self.node is not None:
            self._executor.shutdown(timeout_sec=0)
            self.node.destroy_node()
            self.node = None
            self._rclpy.shutdown(context=self._context)


def imported(name: str) -> Any:
    """Return a module of ROS; `FsmkitError` where it is not installed."""
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
