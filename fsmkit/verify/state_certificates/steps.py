"""Perform the steps of one state at a time for the checker of certificates.

Run as ``python -m fsmkit.verify.state_certificates.steps SYSTEM OPTIONS``. ``OPTIONS`` is JSON
with ``parameters``, ``strict`` and the ``options`` of the certificate. Each line of the input is
answered by one line of JSON:

* ``header``: the header that a certificate of this system has.
* an object: a local state. It gets the next number of its machine, and the answer is that number.
* ``initial``: the initial states, as for a state.
* an array: a state, the numbers of the local states of all machines. The answer has ``to``, the
  states that its steps lead to, and ``violated``, the numbers of the covered properties that the
  state or a step violates. A local state that was not given has a greater number.

An answer with the key ``error`` is the last one.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from fsmkit.diagnostics import Findings
from fsmkit.diagnostics.parsing import parse_json
from fsmkit.system.any_file import load_any
from fsmkit.system.system import System
from fsmkit.verify.explore import ExplorationOptions
from fsmkit.verify.state_certificates.certificate import (
    closed_for,
    header_of,
    local_line,
    options_of,
)
from fsmkit.verify.state_certificates.claims import Truth
from fsmkit.verify.state_certificates.encoding import decode, json_line
from fsmkit.verify.statespace.global_steps import Edge, GlobalSteps


class StepServer:
    """Answers the lines of the checker."""

    def __init__(self, system: System, options: ExplorationOptions) -> None:
        """Close a system for the options of a certificate."""
        self.steps = GlobalSteps(closed_for(system, options))
        self.truth = Truth(self.steps)
        self.header = header_of(self.steps.closed, options, system)

    def answer(self, line: str) -> Any:
        """Return the answer to a line. Raises `ValueError` and others for invalid lines."""
        if line == "header":
            return self.header
        if line == "initial":
            return self._result(self.steps.initial(), set())
        request = parse_json(line)
        if isinstance(request, dict):
            return self._add(request, line)
        state = tuple(request)
        for local_states, number in zip(self.steps.local_states, state, strict=True):
            if not 0 <= number < len(local_states):
                raise ValueError(f"there is no local state {number}")
        return self._result(self.steps.successors(state), self.truth.violated_by(state))

    def _add(self, request: dict[str, Any], line: str) -> int:
        machine = request.pop("machine")
        expected = len(self.steps.local_states[machine])
        number = self.steps.intern(machine, decode(request))
        if number != expected:
            raise ValueError("the local state is there twice")
        if local_line(machine, self.steps, number) != line:
            raise ValueError("the local state is not in canonical form")
        return number

    def _result(self, edges: Iterable[Edge], violated: set[int]) -> dict[str, Any]:
        found = list(edges)
        reached = dict.fromkeys(edge.to for edge in found)
        violated |= self.truth.violated_in(found)
        return {"to": list(reached), "violated": sorted(violated)}


def _write(answer: object) -> None:
    sys.stdout.write(json_line(answer) + "\n")
    sys.stdout.flush()


def main(arguments: list[str]) -> int:
    """Answer the lines of standard input; return 1 after an error."""
    path, given = arguments
    try:
        chosen = parse_json(given)
        parameters, strict = chosen["parameters"], chosen["strict"]
        system = load_any(Path(path), Findings(), strict=strict, parameters=parameters)
        server = StepServer(system, options_of(chosen["options"]))
        for line in sys.stdin:
            _write(server.answer(line.rstrip("\n")))
    except Exception as error:  # noqa: BLE001  (whatever a line of an invalid certificate causes)
        _write({"error": f"{type(error).__name__}: {error}"})
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
