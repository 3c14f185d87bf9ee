"""Set inputs and shared variables of a machine to the values that its connections carry."""

from __future__ import annotations

from dataclasses import replace

from fsmkit.language import Value
from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.system.machine import Machine
from fsmkit.system.shared import with_slot


def driven(machine: Machine, snapshot: Snapshot, number: int, value: Value) -> Snapshot:
    """Return `snapshot` with input `number` set to `value`.

    Numbers after the last input select the shared variables of the machine.
    """
    count = len(snapshot.inputs)
    if number >= count:
        data = with_slot(machine.shared[number - count], snapshot.data, value)
        return replace(snapshot, data=data)
    inputs = list(snapshot.inputs)
    inputs[number] = value
    return replace(snapshot, inputs=tuple(inputs))
