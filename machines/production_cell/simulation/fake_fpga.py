"""The plant behind registers: a board whose wires are a window of a file, as of an FPGA.

The FPGA counts encoders, drives motors by pulse widths, and has sensors and lamps on its pins. Here
the plant does: before a step its signals are put into the registers, and the request brings zeros;
after it the commands are taken from the registers, whatever the reply says of them.
"""

from __future__ import annotations

import json

import numpy as np

from fsmkit.carriers.wires.registers import Registers, places_of

from .nodes import CellError, Process

INITIAL, STEP = b"I", b"S"
HEAD = 8
"""Bytes of the reply to a step before the outputs."""


class BoardBehindRegisters(Process):
    """A board whose inputs and outputs are registers."""

    _registers: Registers | None = None

    def begin(self) -> None:
        """Create the registers, all zero, and start the board."""
        window = self.program.window
        assert window is not None  # noqa: S101  (else it is another process)
        path, description = window
        try:
            places = places_of(json.loads(description.read_text(encoding="utf-8")))
            self._registers = Registers(path, places, create=True)
        except (OSError, ValueError) as error:
            raise CellError(f"{self.program.name} has no registers: {error}") from error
        super().begin()

    @property
    def registers(self) -> Registers:
        """The window."""
        assert self._registers is not None  # noqa: S101  (it was started)
        return self._registers

    def send(self, kind: bytes, body: bytes = b"") -> None:
        """Put the inputs of a request into the registers; the request has zeros for them."""
        if kind in (INITIAL, STEP):
            inputs = self.node.ports.inputs
            head = len(body) - 4 * len(inputs)
            values = np.frombuffer(body, "<i4", offset=head).tolist()
            for name, value in zip(inputs, values, strict=True):
                self.registers.set(name, value)
            body = body[:head] + bytes(4 * len(inputs))
        super().send(kind, body)

    def receive(self, kind: bytes) -> bytes:
        """Return a reply with the outputs that the registers have."""
        body = super().receive(kind)
        if kind not in (INITIAL, STEP):
            return body
        head = HEAD if kind == STEP else 0
        values = np.frombuffer(body, "<i4", offset=head).copy()
        for place, name in enumerate(self.node.ports.outputs):
            if name in self.registers.places:
                values[place] = self.registers.get(name)
        return body[:head] + values.tobytes()

    def kill(self) -> None:
        """Kill the board; its registers go with it."""
        super().kill()
        self._close()

    def end(self) -> None:
        """Let the board end, and close its registers."""
        super().end()
        self._close()

    def _close(self) -> None:
        if self._registers is not None:
            self._registers.close()
            self._registers = None
