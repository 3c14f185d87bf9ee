"""Machines of python-statemachine as they are written, and what is rejected."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("statemachine")

from statemachine import State, StateChart, StateMachine

from fsmkit.diagnostics import Findings, Severity
from fsmkit.foreign.pystatemachine.plugin import PLUGIN
from fsmkit.foreign.pystatemachine.reader import import_object
from fsmkit.yaml.writer import write_document


class Light(StateMachine):
    """A light with a fuse."""

    green = State(initial=True)
    yellow = State()
    red = State(enter="stop_cars")
    broken = State(final=True)
    cycle = green.to(yellow, cond="ready and !busy") | yellow.to(red) | red.to(green, unless="busy")
    blow = green.to(broken) | yellow.to(yellow, internal=True)

    def __init__(self) -> None:
        """Fail: a class is read without being started."""
        raise AssertionError

    def on_exit_green(self) -> None:
        """Do nothing."""

    def before_cycle(self) -> None:
        """Do nothing."""

    def stop_cars(self) -> None:
        """Do nothing."""

    def ready(self) -> bool:
        """Return whether cars may go."""
        return True

    def busy(self) -> bool:
        """Return whether people walk."""
        return False


def rejections(found: object) -> list[str]:
    """Return the messages of the errors for a machine."""
    findings = Findings()
    assert PLUGIN.read_object(found, "machine", findings) is None
    return [one.message for one in findings if one.severity is Severity.ERROR]


def test_a_class_becomes_a_chart_without_being_started() -> None:
    """Callbacks are operations in the library's order: before, exit, on, enter, after."""
    findings = Findings()
    found = import_object(Light, "lights.py:Light", findings)
    assert found is not None
    text = write_document(found.document)
    assert "do: before_cycle(); on_exit_green()" in text
    assert "if: (ready() and (not busy()))" in text
    assert "if: not busy()" in text
    assert "blow: {ordered: true}" in text
    assert "do: before_cycle(); stop_cars()" in text
    assert found.document.doc == "A light with a fuse."
    assert [one.rule.name for one in findings] == ["import-differs"]


def test_other_objects_are_left_to_other_readers() -> None:
    """An object that is no machine of the library gives no document and no finding."""
    findings = Findings()
    assert PLUGIN.read_object({"states": []}, "machine", findings) is None
    assert not list(findings)


class Nested(StateChart[Any]):
    """``before`` comes before the callbacks of an exit."""

    class outer(State.Compound):  # noqa: N801  (the library's way to declare a state)
        """A compound state."""

        inner = State(initial=True, exit="leave")
        other = State()
        turn = inner.to(other, before="first") | other.to(inner)

    def leave(self) -> None:
        """Do nothing."""

    def first(self) -> None:
        """Do nothing."""


class Validated(StateChart[Any]):
    """Validators raise exceptions."""

    one = State(initial=True)
    two = State()
    go = one.to(two, validators="check") | two.to(one)

    def check(self) -> None:
        """Do nothing."""


class Pattern(StateChart[Any]):
    """A pattern of events."""

    one = State(initial=True)
    two = State()
    go = one.to(two) | two.to(one)
    one.to(two, event="*")


@pytest.mark.parametrize(
    ("kind", "part"),
    [
        (Nested, "called before states are left"),
        (Validated, "validators"),
        (Pattern, "pattern"),
    ],
)
def test_what_no_chart_expresses_is_rejected(kind: type[object], part: str) -> None:
    """Each reason has a message that refers to the listing of the machine."""
    assert any(part in message for message in rejections(kind))
