"""A small chart to be looked at, and a client that keeps what it is told."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import pytest

import fsmkit
from fsmkit.inspector.hub import Hub

if TYPE_CHECKING:
    from playwright.sync_api import Browser

GATE = """\
chart: Gate
types:
  Fault: [none, jam, lost]
constants:
  T_OPEN: 4s
data:
  count: 0..100 = 0
  fault_code: Fault = Fault.none
inputs:
  blocked: bool
outputs:
  motor: bool
events:
  in: [open, close, fault(code Fault)]
  out: [opened]
initial: closed
states:
  closed:
    on:
      open: {target: opening, if: not blocked}
  opening:
    entry: motor = true
    exit: motor = false
    after:
      T_OPEN: {target: wide, do: [count = count + 1, send opened]}
    on:
      fault: {target: broken, if: event.code != Fault.none, do: fault_code = event.code}
  wide:
    on: {close: closed}
  broken:
"""

REGIONS = """\
chart: Press
events:
  in: [start, stop, tick, lamp, blink]
data: {x: 0..100 = 0}
initial: waiting
states:
  waiting:
    on: {start: working}
  working:
    on: {stop: waiting}
    regions:
      motion:
        initial: idle
        states:
          idle: {on: {tick: {target: moving, do: x += 1}}}
          moving:
            initial: slow
            on: {tick: idle}
            states:
              slow: {on: {blink: fast}}
              fast:
                regions:
                  left: {initial: l1, states: {l1: {on: {blink: l2}}, l2: {}}}
                  right: {initial: r1, states: {r1: {on: {blink: r2}}, r2: {}}}
      light:
        initial: off
        states:
          off: {on: {lamp: on}}
          on: {on: {lamp: off}}
"""
"""Regions in a state, and regions in a state of one of them."""


def elaborated(text: str) -> fsmkit.Chart:
    """Return the chart of a text."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "chart.yaml"
        path.write_text(text, encoding="utf-8")
        return fsmkit.read_chart(path)


class Client:
    """Whoever looks on: it keeps all messages, decoded."""

    def __init__(self, hub: Hub, *, may_command: bool = True) -> None:
        self.hub = hub
        self.told: list[dict[str, Any]] = []
        self._id = 0
        self.number = hub.join(self._take, may_command=may_command)

    def _take(self, text: bytes) -> None:
        found = json.loads(text)
        self.told += found if isinstance(found, list) else [found]

    def say(self, do: str, **fields: Any) -> dict[str, Any]:
        """Give a command; return its answer."""
        self._id += 1
        self.hub.receive(self.number, json.dumps({"id": self._id, "do": do, **fields}))
        (answer,) = [m for m in self.told if m["k"] in ("done", "refused") and m["re"] == self._id]
        return answer

    def result(self, do: str, **fields: Any) -> Any:
        """Give a command that is obeyed; return its result."""
        answer = self.say(do, **fields)
        assert answer["k"] == "done", answer
        return answer.get("result")

    def last(self, kind: str) -> dict[str, Any]:
        """Return the last message of a kind."""
        return next(m for m in reversed(self.told) if m["k"] == kind)


@pytest.fixture(autouse=True)
def undrawn(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave drawings out where the test is not marked as one that starts `dot`."""
    if request.node.get_closest_marker("external") is None:
        monkeypatch.setattr("fsmkit.inspector.charts.MOST_DRAWN", 0)


@pytest.fixture
def gate(tmp_path: Path) -> Path:
    """Write the chart of a gate."""
    path = tmp_path / "gate.yaml"
    path.write_text(GATE, encoding="utf-8")
    return path


@pytest.fixture
def client(gate: Path) -> Client:
    """Look at a gate."""
    return Client(Hub(fsmkit.read_chart(gate), file=gate, session="s"))


@pytest.fixture(scope="module")
def browser(require_tool: Callable[[str], str]) -> Iterator[Browser]:
    """Start a browser."""
    from playwright.sync_api import sync_playwright

    path = require_tool("chromium")
    with sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield found
        found.close()
