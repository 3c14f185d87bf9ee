"""The charts as data, read from SCXML independently of fsmkit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from lxml import etree

FOLDER = Path(__file__).parent
LETTERS = ("A", "B", "C")
NAMESPACE = "{http://www.w3.org/2005/07/scxml}"
KINDS = {f"{NAMESPACE}state", f"{NAMESPACE}parallel"}

Content = tuple[tuple[str, str], ...]
"""Assignments: a variable and an expression, which is valid C, JavaScript and Python."""


@dataclass(frozen=True, slots=True)
class Transition:
    """An external transition, or one without a target, which exits nothing."""

    source: str
    event: str
    guard: str | None
    target: str | None
    content: Content


@dataclass(frozen=True, slots=True)
class State:
    """A state of a chart."""

    name: str
    parent: str | None
    children: tuple[str, ...]
    initial: str | None
    """The default child of a compound state."""
    is_parallel: bool
    entry: Content
    exit: Content
    transitions: tuple[Transition, ...]


@dataclass(frozen=True, slots=True)
class History:
    """A deep history."""

    parent: str
    default: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Chart:
    """A chart; states are in document order."""

    name: str
    initial: str
    variables: Mapping[str, int]
    """Start values, in the order of the digests."""
    states: Mapping[str, State]
    histories: Mapping[str, History]

    def path(self, name: str) -> tuple[str, ...]:
        """Return a state and its ancestors, inner states first."""
        parent = self.states[name].parent
        return (name,) if parent is None else (name, *self.path(parent))

    def roots(self) -> list[State]:
        """Return the states that have no parent."""
        return [state for state in self.states.values() if state.parent is None]


def chart_file(letter: str) -> Path:
    """Return the path of a chart of the yardstick."""
    return FOLDER / f"{letter}.scxml"


def read_chart(path: Path) -> Chart:
    """Read a chart with the features of the yardstick's charts only."""
    root = etree.parse(path).getroot()
    states = {state.name: state for state in _states(root, None)}
    histories = {
        _text(node, "id"): History(
            _text(_parent(node), "id"), tuple(_text(node[0], "target").split())
        )
        for node in root.iter(f"{NAMESPACE}history")
    }
    data = root.iter(f"{NAMESPACE}data")
    variables = {_text(node, "id"): int(_text(node, "expr")) for node in data}
    return Chart(_text(root, "name"), _text(root, "initial"), variables, states, histories)


def _states(node: etree._Element, parent: str | None) -> Iterator[State]:
    """Yield the states below an element in document order."""
    for child in node:
        if child.tag not in KINDS:
            continue
        name = _text(child, "id")
        yield State(
            name,
            parent,
            tuple(_text(inner, "id") for inner in child if inner.tag in KINDS),
            child.get("initial"),
            child.tag == f"{NAMESPACE}parallel",
            _content(child.find(f"{NAMESPACE}onentry")),
            _content(child.find(f"{NAMESPACE}onexit")),
            tuple(
                Transition(name, _text(t, "event"), t.get("cond"), t.get("target"), _content(t))
                for t in child.findall(f"{NAMESPACE}transition")
            ),
        )
        yield from _states(child, name)


def _content(node: etree._Element | None) -> Content:
    """Return the assignments in an element."""
    if node is None:
        return ()
    found = node.findall(f"{NAMESPACE}assign")
    return tuple((_text(assign, "location"), _text(assign, "expr")) for assign in found)


def _parent(node: etree._Element) -> etree._Element:
    parent = node.getparent()
    assert parent is not None
    return parent


def _text(node: etree._Element, attribute: str) -> str:
    """Return an attribute that must be present."""
    return str(node.attrib[attribute])
