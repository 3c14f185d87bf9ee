"""Record the actions of a person as lines of a script, which can be replayed bit for bit.

A session is a file of YAML: the options of the run, its length in steps, and a line for each action
at the panel: the step after it, an event of ``panel.yaml``, its values.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import yaml

from fsmkit.diagnostics import FsmkitError
from fsmkit.language.values import to_python, tokens
from fsmkit.runtime.interpreter.snapshot import Occurrence
from fsmkit.runtime.script import read_event, script_texts

from ..simulation import recording
from ..simulation.nodes import CellError
from ..simulation.orchestrator import Orchestrator
from ..simulation.recording import Frame
from .panel import Panel, chart

HEAD = "# A session with the Production Cell: make cell SESSION=FILE does it again, bit for bit.\n"
PYTEST = '''"""A session with the Production Cell: done again, it is the same, bit for bit."""

from pathlib import Path

import pytest

from machines.production_cell.live.again import digest_of

SESSION = """\\
{session}"""
DIGEST = "{digest}"


@pytest.mark.cc
def test_it_does_so_again(tmp_path: Path) -> None:
    assert digest_of(SESSION, tmp_path) == DIGEST
'''
OPTIONS: Mapping[str, type] = {
    "seed": int, "blocks": int, "fault": str, "bad": float, "sorter": str, "drift": float,
    "estimator": str, "aruco": bool, "plant": str, "double": bool, "registers": bool,
}  # fmt: skip
"""The options of a run that make a difference to it."""


@dataclass(frozen=True, slots=True)
class Deed:
    """Something done at the panel, before a step."""

    step: int
    what: Occurrence

    def __str__(self) -> str:
        """Return it as a line of a session."""
        event = chart().events[self.what.event]
        pairs = zip(event.fields, self.what.payload, strict=True)
        return " ".join(
            (str(self.step), event.name, *(str(to_python(v, f.type)) for f, v in pairs))
        )


@dataclass(frozen=True, slots=True)
class Session:
    """A run that was driven by hand."""

    options: Mapping[str, Any]
    steps: int
    deeds: tuple[Deed, ...]

    def __str__(self) -> str:
        """Return it as a file."""
        lines = {
            "options": dict(self.options), "steps": self.steps, "done": list(map(str, self.deeds)),
        }  # fmt: skip
        return HEAD + yaml.safe_dump(lines, sort_keys=False)


def read(text: str, name: str = "<session>") -> Session:
    """Return the session of a file. Raises `CellError`."""
    try:
        found = yaml.safe_load(text)
        options, steps, done = found["options"], found["steps"], found["done"]
        wrong = [k for k, v in options.items() if not isinstance(v, OPTIONS.get(k, ()))]
        if wrong or isinstance(steps, bool) or not isinstance(steps, int) or steps < 1:
            raise CellError(
                f"{name}: `{wrong[0] if wrong else 'steps'}` has no value that it can have"
            )
        deeds = tuple(_deed(str(line), name) for line in done)
    except (yaml.YAMLError, KeyError, TypeError, AttributeError) as error:
        raise CellError(f"{name} is no session of the cell: {error}") from error
    if list(deeds) != sorted(deeds, key=lambda deed: deed.step):
        raise CellError(f"{name}: what was done is not in the order of time")
    return Session(options, steps, deeds)


def _deed(line: str, name: str) -> Deed:
    step, _, rest = line.partition(" ")
    if not step.isdecimal() or int(step) < 1:
        raise CellError(f"{name}: `{line}` does not start with the number of a step")
    try:
        (text,) = script_texts([rest], name)
        return Deed(int(step), read_event(chart(), iter(tokens(rest)), text))
    except (FsmkitError, ValueError) as error:
        raise CellError(f"{name}: `{line}`: {error}") from error


class Again:
    """Does at each step what a session did there."""

    def __init__(self, deeds: Sequence[Deed]) -> None:
        self._deeds = list(deeds)
        self._panel: Panel | None = None

    def begin(self, run: Orchestrator) -> None:
        """Take the panel in hand."""
        self._panel = Panel(run)

    def before(self, number: int) -> None:
        """Do what was done before this step."""
        while self._panel is not None and self._deeds and self._deeds[0].step <= number:
            self._panel.do(number, self._deeds.pop(0).what)

    def after(self, number: int) -> None:
        """See nothing."""

    def died(self, number: int, board: str, why: str) -> bool:
        """End the run: that was not so."""
        del number, board, why
        return False


class Digest:
    """The digest of the values of all signals in all steps."""

    def __init__(self) -> None:
        self._hash = sha256()

    def add(self, values: Frame) -> None:
        """Take in a step, or several."""
        self._hash.update(values.astype("<i4", copy=False).tobytes())

    def __str__(self) -> str:
        """Return it in hexadecimal."""
        return self._hash.hexdigest()


def digest(path: Path) -> str:
    """Return the digest of a recording. Raises `RecordingError`, OSError."""
    found = Digest()
    found.add(recording.read(path).frames)
    return str(found)


def pytest_of(session: Session, found: str) -> str:
    """Return a test that does a session again and compares its recording."""
    text = str(session).replace("\\", "\\\\").replace('"""', '\\"\\"\\"')
    return PYTEST.format(session=text, digest=found)
