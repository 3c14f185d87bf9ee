"""Services of ROS 2 for events with a result, offered by rclpy."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.carriers.ros.messages import COUNTERS, RosField, event_type
from fsmkit.emit import Identifier
from fsmkit.language import BoolType, Field, Type

SET_BOOL = "std_srvs/srv/SetBool"
TRIGGER = "std_srvs/srv/Trigger"
STANDARD_SERVICES = (SET_BOOL, TRIGGER)
"""Services of ROS that an event can be bound to; their response is `success` and `message`."""
DATA = RosField(Identifier("data"), "bool")


@dataclass(frozen=True, slots=True)
class RosService:
    """A service of a machine.

    ``number``: the event's, of the event map; ``request``: its fields, by their indices, with the
    types of their values; ``response``: the field with the result, beside ``handled``; None for one
    of `STANDARD_SERVICES`.
    """

    name: str
    package: str
    type: str
    number: int
    request: tuple[RosField, ...]
    types: tuple[Type, ...]
    response: RosField | None
    reply: Type
    tick: int


def generated_service(
    name: str,
    of: tuple[Identifier, Identifier],
    number: int,
    fields: tuple[Field, ...],
    reply: Type,
    tick: int,
) -> RosService:
    """Return a service of a type of its own; ``of``: the package and the name of that."""
    package, type_ = of
    own = tuple(field.type for field in fields)
    sent, _ = event_type(package, type_, [(field.name, field.type) for field in fields])
    returned, _ = event_type(package, type_, [("value", reply)])
    request, (value,) = sent.fields[len(COUNTERS) :], returned.fields[len(COUNTERS) :]
    return RosService(name, package, type_, number, request, own, value, reply, tick)


def standard_service(
    name: str, type_: str, number: int, fields: tuple[Field, ...], reply: Type
) -> RosService | None:
    """Return a service of a type of ROS; None if it does not hold the fields."""
    package, _, short = type_.split("/")
    own = tuple(field.type for field in fields)
    request = (DATA,) if type_ == SET_BOOL else ()
    if len(own) != len(request) or any(not isinstance(each, BoolType) for each in own):
        return None
    return RosService(name, package, short, number, request, own, None, reply, 1)
