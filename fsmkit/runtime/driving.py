"""What a connection brings to a machine: a value for one of its inputs or shared variables."""

from __future__ import annotations

from dataclasses import replace

from fsmkit.language import Value
from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.system.machine import Machine
from fsmkit.system.shared import with_slot


def driven(machine: Machine, snapshot: Snapshot, number: int, value: Value) -> Snapshot:
    """Return a machine whose input, or shared variable, ``number`` has got a value."""
    count = len(snapshot.inputs)
    if number >= count:
        data = with_slot(machine.shared[number - count], snapshot.data, value)
        return replace(snapshot, data=data)
    inputs = list(snapshot.inputs)
    inputs[number] = value
    return replace(snapshot, inputs=tuple(inputs))
