"""Machines of python-statemachine as they are written, and what is rejected."""

from __future__ import annotations

from collections.abc import Callable
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


def written(found: object) -> str:
    """Return the chart of a machine as YAML."""
    findings = Findings()
    imported = import_object(found, "machine", findings)
    findings.stop_on_errors()
    assert imported is not None
    return write_document(imported.document)


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
    """A validator rejects an event that an outer state handles, too."""

    class outer(State.Compound):  # noqa: N801  (the library's way to declare a state)
        """A compound state."""

        one = State(initial=True)
        two = State(final=True)

    end = State(final=True)
    go = outer.one.to(outer.two, validators="check") | outer.to(end)

    def check(self) -> None:
        """Do nothing."""


class Fallthrough(StateChart[Any]):
    """The rejection of a validator also holds for the transitions after it."""

    one = State(initial=True)
    two = State()
    go = one.to(two, cond="ready", validators="check") | one.to(one) | two.to(one)

    def check(self) -> None:
        """Do nothing."""

    def ready(self) -> bool:
        """Return whether it is ready."""
        return True


def regions(
    steps: Callable[..., dict[str, Any]] = lambda *_: {}, **more: Any
) -> type[StateChart[Any]]:
    """Return a machine whose parallel state has two regions; ``steps`` adds transitions."""
    left = State("left", states=[State("a", initial=True), State("b", final=True)])
    right = State("right", states=[State("c", initial=True), State("d", final=True)])
    for region in (left, right):
        for state in region.states:
            state._set_id(state.name)
        region._set_id(region.name)
    both = State("both", states=[left, right], parallel=True, initial=True)
    both._set_id("both")
    (a, b), (c, d) = left.states, right.states
    events = {"go": a.to(b), "stop": c.to(d), **steps(both, a, c, more.get("after"))}
    kind: Any = type(StateChart)
    found: type[StateChart[Any]] = kind("Machine", (StateChart,), {"both": both, **events, **more})
    return found


def callback(_: object) -> None:
    """Do nothing."""


END = "if: (In(b)) and (In(d)), target: ended, ordered: true"


def test_a_parallel_state_that_is_done_ends_the_machine() -> None:
    """A transition that leaves the state then prevents the end, one with a condition may not."""
    assert END in written(regions())
    after = State("after", final=True)
    leaving = regions(lambda both, _, __, after: {"done_state_both": both.to(after)}, after=after)
    assert "ended" not in written(leaving)
    after = State("after", final=True)
    guarded = regions(
        lambda both, _, __, after: {"done_state_both": both.to(after, cond="ready")},
        after=after, ready=lambda _: True,
    )  # fmt: skip
    text = written(guarded)
    assert text.index("ready()") < text.index(END)


def test_a_validator_is_a_condition_of_all_transitions_after_it() -> None:
    text = written(Fallthrough)
    assert "{if: check() and ready(), target: two, ordered: true}" in text
    assert "{if: check(), target: one, ordered: true}" in text


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
        (Validated, "validators reject `go` for regions or for outer states"),
        (Pattern, "pattern"),
        (regions(on_exit_b=callback), "does not call `on_exit`"),
        (regions(lambda _, a, __, ___: {"done_state_both": a.to(a)}), "handles that and stays"),
        (
            regions(lambda _, a, c, __: {"both_go": a.to(a, on="f") | c.to(c, on="f")}, f=callback),
            "transitions of two regions",
        ),
        (
            regions(
                lambda _, a, c, after: {"x": a.to(after) | c.to(c)},
                after=State("after", final=True),
            ),
            "transitions of two regions",
        ),
        (regions(lambda _, a, __, ___: {"x": a.to(a, internal=True)}), "the other regions again"),
    ],
)
def test_what_no_chart_expresses_is_rejected(kind: type[object], part: str) -> None:
    """Each reason has a message that refers to the listing of the machine."""
    assert any(part in message for message in rejections(kind))
