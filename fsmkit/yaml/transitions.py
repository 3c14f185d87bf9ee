"""Reading of YAML nodes into the transitions of a state."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.diagnostics.fast_init import fast_init
from fsmkit.document import keys
from fsmkit.document.document import DocTransition, Trigger
from fsmkit.yaml.fields import Fields, names, words
from fsmkit.yaml.nodes import Mapping, Node, Sequence, require_mapping

BY_NAME = {"on": Trigger.EVENT, "after": Trigger.AFTER, "every": Trigger.EVERY}
"""Keys that hold `event or delay: transition`."""
PLAIN = {
    "always": Trigger.EVENTLESS,
    "choice": Trigger.EVENTLESS,
    "sometimes": Trigger.SOMETIMES,
}
"""Keys that hold transitions."""

MISTAKEN = {"event", "events", "delay", "time", "trigger", "if", "do"}
"""Keys beside ``target`` that reveal a single transition where several are expected."""


@fast_init
@dataclass(frozen=True, slots=True)
class Label:
    """The trigger of a transition, and its location."""

    trigger: Trigger
    key: Text | None = None
    events: tuple[Text, ...] = ()
    delay: Text | None = None


def read_initial(fields: Fields, key: str, findings: Findings) -> DocTransition | None:
    """Read ``initial`` or ``default``: targets, or an object with ``target`` and ``do``."""
    node = fields.node(key)
    if node is None:
        return None
    if not isinstance(node, Mapping):
        targets = names(node, f"`{key}`", findings)
        return DocTransition(Trigger.INITIAL, node.span, targets=targets)
    inner = Fields(node, keys.INITIAL, f"`{key}`", findings)
    return DocTransition(Trigger.INITIAL, node.span, **inner.read())


def read_exit(node: Node, name: Text, findings: Findings) -> tuple[DocTransition, ...]:
    """Read the value of an exit point: targets, an object, or a list of either."""
    found = []
    for item in _items(node):
        place = _place(item, name)
        if isinstance(item, Mapping):
            fields = Fields(item, keys.EXIT, "an exit", findings)
            found.append(DocTransition(Trigger.EVENTLESS, place, **fields.read()))
        else:
            targets = names(item, "a target", findings)
            found.append(DocTransition(Trigger.EVENTLESS, place, targets=targets))
    return tuple(found)


def read_transitions(fields: Fields, findings: Findings) -> tuple[DocTransition, ...]:
    """Read the transitions of a state, in the order written."""
    return tuple(t for key in fields.order for t in _under(key, fields, findings))


def _under(key: str, fields: Fields, findings: Findings) -> Iterator[DocTransition]:
    node = fields.node(key)
    if key in BY_NAME:
        entries = fields.entries(key)
        names_ = {name.value for name, _ in entries}
        if "target" in names_ and names_ & MISTAKEN:
            findings.add(
                "unexpected-shape",
                f"`{key}` names {'events' if key == 'on' else 'times'}, each with its transition",
                entries[0][0],
                help=f"write `{key}: {{{'go' if key == 'on' else '5s'}: {{target: idle}}}}`",
            )
            return
        for name, value in entries:
            yield from _listed(value, label_of(BY_NAME[key], name, findings), findings)
    elif key in PLAIN and node is not None:
        yield from _listed(node, Label(PLAIN[key]), findings)
    elif key == "transitions" and node is not None:
        for item in _items(node):
            mapping = require_mapping(item, "an entry of `transitions`", findings)
            if mapping is not None:
                yield _labelled(mapping, findings)


def label_of(trigger: Trigger, name: Text, findings: Findings) -> Label:
    """Return the label for a key under ``on``, ``after`` or ``every``."""
    if trigger is not Trigger.EVENT:
        return Label(trigger, name, delay=name)
    events = words(name)
    if not events:
        findings.add(
            "unexpected-shape", "an event is missing", name, help="name it before the colon"
        )
    return Label(trigger, name, events)


def _items(node: Node) -> tuple[Node, ...]:
    return node.items if isinstance(node, Sequence) else (node,)


def _listed(node: Node, label: Label, findings: Findings) -> Iterator[DocTransition]:
    for item in _items(node):
        place = _place(item, label.key)
        if isinstance(item, Mapping):
            fields = Fields(item, keys.TRANSITION, "a transition", findings)
            yield _transition(fields, label, place)
        else:
            targets = names(item, "a target", findings)
            yield DocTransition(label.trigger, place, label.events, label.delay, targets=targets)


def _labelled(mapping: Mapping, findings: Findings) -> DocTransition:
    """Read an entry of ``transitions``, which contains its trigger."""
    fields = Fields(mapping, keys.LABELLED, "a transition", findings)
    given = [key for key in fields.order if key in keys.LABEL]
    if len(given) != 1:
        findings.add(
            "missing-key" if not given else "unexpected-shape",
            "a transition waits for one thing",
            fields.keys[given[1]] if given else mapping.span,
            help="give it one of `on`, `after`, `every`, `always` and `sometimes`",
        )
    label = Label(Trigger.EVENTLESS)
    for key in given[:1]:
        if key == "on":
            label = Label(Trigger.EVENT, events=fields.names("on"))
        elif key in BY_NAME:
            label = Label(BY_NAME[key], delay=fields.text(key))
        else:
            fields.flag(key)
            label = Label(PLAIN[key])
    return _transition(fields, label, _place(mapping, None))


def _transition(fields: Fields, label: Label, place: Span) -> DocTransition:
    return DocTransition(label.trigger, place, label.events, label.delay, **fields.read())


def _place(node: Node, key: Text | None) -> Span:
    """Return the first line of a transition, from its event or delay on if that is on it."""
    start = node.span.start
    text = node.span.source.text
    if key is not None and text.find("\n", key.span.start, start) < 0:
        start = key.span.start
    line_end = text.find("\n", start, node.span.end)
    end = node.span.end if line_end < 0 else line_end
    return Span(node.span.source, start, start + len(text[start:end].rstrip()))
