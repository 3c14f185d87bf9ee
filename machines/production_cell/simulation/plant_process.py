"""The plant as a process."""

from __future__ import annotations

import argparse
import os
import signal
from collections.abc import Sequence
from dataclasses import asdict

from . import plant
from .protocol import Json, Values, serve
from .signals import PLANT, STEP

MOST_EVENTS = 10_000
"""Events kept for the report."""
TOLD = frozenset({"inserted", "moulded"})
"""Events that are only counted: they are part of the work."""


class PlantServer:
    """The plant behind the protocol."""

    name = "plant"
    ports = PLANT

    def __init__(self, seed: int) -> None:
        self._plant, self._state = plant.make(seed)
        self._events: list[Json] = []
        self._outputs: list[int] = []

    @property
    def outputs(self) -> Sequence[int]:
        """The outputs as they are now."""
        return self._outputs

    def about(self) -> Json:
        """Return that there are no frames."""
        return {"peers": []}

    def initial(self, inputs: Values) -> Sequence[int]:
        """Return what the sensors say before anything moves."""
        del inputs
        self._outputs = plant.outputs(self._plant, self._state)
        return self._outputs

    def step(self, number: int, inputs: Values) -> Sequence[int]:
        """Advance by a millisecond."""
        before = self._state
        self._state, events = plant.step(self._plant, before, inputs.tolist())
        for event in events:
            if event.kind not in TOLD and len(self._events) < MOST_EVENTS:
                self._events.append({"time": round(number * STEP, 3), **asdict(event)})
        if any(now is not old for now, old in zip(self._state[1:], before[1:], strict=True)):
            self._outputs = plant.outputs(self._plant, self._state)
        return self._outputs

    def set_parameter(self, name: str, value: float) -> None:
        """Break or repair a part."""
        self._state = plant.with_fault(self._state, name, value)
        self._outputs = plant.outputs(self._plant, self._state)

    def report(self) -> Json:
        """Return what happened, with times in s."""
        return {"events": self._events}


def main() -> None:
    """Serve until the request to quit, or until the parent process is gone."""
    parser = argparse.ArgumentParser(description="The plant of the Production Cell.")
    parser.add_argument("endpoint", help="its endpoint: tcp://127.0.0.1:PORT or ipc://PATH")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the orchestrator says when it ends
    parent = os.getppid()
    serve(PlantServer(options.seed), options.endpoint, lambda: os.getppid() == parent)


if __name__ == "__main__":
    main()
