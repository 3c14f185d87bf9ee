"""Types of packages of ROS that no connection is bound to, as structs of Cyclone DDS."""

# mypy: disable-error-code="misc, call-arg"
# Cyclone DDS reads annotations as objects: they are not postponed here.

from dataclasses import dataclass

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import sequence, uint8, uint32


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
