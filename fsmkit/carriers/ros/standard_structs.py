"""Types of packages of ROS that no connection is bound to, as structs of Cyclone DDS."""

# mypy: disable-error-code="misc, call-arg"
# Cyclone DDS reads annotations as objects: they are not postponed here.

from dataclasses import dataclass

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import byte, int32, sequence, uint8, uint32


@dataclass
class Dimension(IdlStruct, typename="std_msgs.msg.dds_.MultiArrayDimension_"):
    """``std_msgs/msg/MultiArrayDimension``."""

    label: str
    size: uint32
    stride: uint32


@dataclass
class Layout(IdlStruct, typename="std_msgs.msg.dds_.MultiArrayLayout_"):
    """``std_msgs/msg/MultiArrayLayout``."""

    dim: sequence[Dimension]
    data_offset: uint32


@dataclass
class UInt8MultiArray(IdlStruct, typename="std_msgs.msg.dds_.UInt8MultiArray_"):
    """``std_msgs/msg/UInt8MultiArray``."""

    layout: Layout
    data: sequence[uint8]


@dataclass
class Time(IdlStruct, typename="builtin_interfaces.msg.dds_.Time_"):
    """``builtin_interfaces/msg/Time``."""

    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs.msg.dds_.Header_"):
    """``std_msgs/msg/Header``."""

    stamp: Time
    frame_id: str


@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs.msg.dds_.KeyValue_"):
    """``diagnostic_msgs/msg/KeyValue``."""

    key: str
    value: str


@dataclass
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs.msg.dds_.DiagnosticStatus_"):
    """``diagnostic_msgs/msg/DiagnosticStatus``."""

    level: byte
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@dataclass
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs.msg.dds_.DiagnosticArray_"):
    """``diagnostic_msgs/msg/DiagnosticArray``."""

    header: Header
    status: sequence[DiagnosticStatus]
