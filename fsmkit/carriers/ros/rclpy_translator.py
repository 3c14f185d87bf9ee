"""A foreign node of ROS 2 with services and lifecycle: topics by DDS, the others by rclpy."""

from __future__ import annotations

from typing import Any

from fsmkit.carriers.ros.messages import DURATION, RosField
from fsmkit.carriers.ros.rclpy_node import RclpyNode
from fsmkit.carriers.ros.services import RosService
from fsmkit.carriers.ros.structs import ticks_of
from fsmkit.carriers.ros.topics import RosNode
from fsmkit.carriers.ros.translator import RosTranslator
from fsmkit.language import Type, Value
from fsmkit.language.values import to_python
from fsmkit.runtime.links.codec import bounds
from fsmkit.runtime.links.link import Answer, Link

AT_ONCE = 8
"""Requests and transitions that are served in a cycle, at most."""


class RclpyTranslator(RosTranslator):
    """Connects a link with a foreign node that calls services, or controls this node's lifecycle.

    A request is handled at the start of a cycle. Without `answer` none is handled.
    """

    def __init__(self, link: Link, node: int, ros: RosNode) -> None:
        super().__init__(link, node, ros)
        self.answer: Answer | None = None
        own = link.map.nodes[link.node]
        messages = link.map.messages
        try:
            self._joined_rclpy = RclpyNode(
                own,
                namespace=ros.namespace,
                domain=ros.domain,
                is_insecure=ros.is_insecure,
                life={
                    transition: number
                    for transition, number in ros.lifecycle.items()
                    if messages[number - 1].receiver == link.node
                },
                moved=self._moved,
            )
            try:
                for service in ros.services:
                    if messages[service.number - 1].receiver == link.node:
                        self._offer(service)
            except BaseException:
                self._joined_rclpy.leave()
                raise
        except BaseException:
            super().close()
            raise

    def _offer(self, service: RosService) -> None:
        package = self._joined_rclpy.package(f"{service.package}.srv")
        self._joined_rclpy.node.create_service(
            getattr(package, service.type),
            service.name,
            lambda request, response: self._serve(service, request, response),
        )

    def _serve(self, service: RosService, request: Any, response: Any) -> Any:
        self.counters.received += 1
        values = [
            _taken(getattr(request, field.name), field, service.tick) for field in service.request
        ]
        is_handled, reply = False, None
        if not all(
            _is_of(value, type_) for value, type_ in zip(values, service.types, strict=True)
        ):
            self._reject()
        elif self.answer is not None:
            is_handled, reply = self.answer(service.number, tuple(values))
        if service.response is None:
            response.success = is_handled and reply is not False
            response.message = "" if reply is None else str(to_python(reply, service.reply))
        else:
            response.handled = is_handled
            if reply is not None:
                _give(response, service.response, reply, service.tick)
        return response

    def _moved(self, number: int) -> None:
        """Post the event of a transition of the node's lifecycle."""
        self.counters.received += 1
        self._arrive(number, ())

    def poll(self) -> None:
        """Deliver received messages, and serve requests."""
        super().poll()
        for _ in range(AT_ONCE):
            self._joined_rclpy.spin()

    def close(self) -> None:
        """Leave both."""
        self._joined_rclpy.leave()
        super().close()


def _taken(given: Any, field: RosField, tick: int) -> Any:
    return ticks_of(given, tick) if field.type == DURATION else given


def _is_of(value: Value, type_: Type) -> bool:
    span = bounds(type_)
    return span is None or (isinstance(value, int) and span[0] <= value <= span[1])


def _give(response: Any, field: RosField, value: Value, tick: int) -> None:
    if field.type == DURATION:
        assert isinstance(value, int)  # noqa: S101  (ticks)
        seconds, rest = divmod(value * tick, 1_000_000)
        duration = getattr(response, field.name)
        duration.sec, duration.nanosec = seconds, rest * 1000
    else:
        setattr(response, field.name, value)
