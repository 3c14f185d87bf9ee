"""Changes of charts in SCXML that keep them XML: elements, attributes and values."""

from __future__ import annotations

import copy
import re
from random import Random
from xml.etree import ElementTree as ET

import atheris

from devtools.fuzz.texts import FORMS, NUMBERS, TYPES, changed, pick, word
from fsmkit.scxml.names import (
    ATTRIBUTES,
    CHILDREN,
    CONTENT,
    EXTENSION,
    EXTENSION_ATTRIBUTES,
    EXTENSION_CHILDREN,
    EXTENSION_CONTENT,
    EXTENSION_ELEMENTS,
    PREFIX,
    SCXML,
)

BYTES = 0.1
"""Probability of byte mutations, which mostly give invalid XML."""
NAME = re.compile(r"[^\W\d][\w.-]*")

STATE_NAMES = ("id", "target", "initial", "state", "defer")
EVENT_NAMES = ("event", "defer", "signature")
FIXED: dict[str, tuple[str, ...]] = {
    "datamodel": ("fsmkit", "ecmascript", "null", "xpath"),
    "binding": ("early", "late"),
    "kind": ("choice", "compound", "parallel", "final"),
    "override": ("true", "false", "entry", "exit", "initial", "entry exit"),
    "type": (*TYPES, "internal", "external", "deep", "shallow", "scxml", "int", "string"),
    "event": ("*", "e", "e.*", "error", "error.execution", "done.state.a", "done.invoke.i", "a b"),
    "target": ("#_internal", "#_parent", "#_i", "#_scxml_1", "peer", "!x"),
    "signature": ("e", "e(n 0..3)", "e(n uint8[4])", "op() -> bool", "op(a bool, b float64)"),
    "direction": ("in", "out", "internal"),
    "members": ("none lost jam", "a", ""),
    "extends": ("base.yaml",),
    "autoforward": ("true", "false"),
    **dict.fromkeys(("after", "every", "delay", "tick"), ("1s", "5ms", ".5s", "0s", "1", "9h")),
    **dict.fromkeys(("queue", "internal", "delayed", "microsteps"), tuple(NUMBERS)),
    **dict.fromkeys(
        ("abstract", "rest", "first", "watchdog", "ordered", "sometimes"), ("true", "false")
    ),
}
INSIDE = {
    **{name: (*CONTENT, *(f"{PREFIX}:{n}" for n in EXTENSION_CONTENT))
       for name in ("onentry", "onexit", "transition", "if", "foreach", "finalize")},
    **{name: (*CHILDREN.get(name, ()), *(f"{PREFIX}:{n}" for n in EXTENSION_CHILDREN.get(name, ())))
       for name in {*CHILDREN, *EXTENSION_CHILDREN}},
    "initial": ("transition",),
    "send": ("param", "content"),
    "donedata": ("param", "content"),
    "invoke": ("param", "content", "finalize"),
    "content": ("scxml",),
    "type": ("fk:field",),
}  # fmt: skip

ET.register_namespace("", SCXML)
ET.register_namespace(PREFIX, EXTENSION)


def mutate(content: bytes, most: int, seed: int) -> bytes:
    """Return a changed chart of at most so many bytes."""
    random = Random(seed)
    root = None if random.random() < BYTES else _read(content)
    if root is None:
        return atheris.Mutate(content, most)
    for _ in range(random.choice((1, 1, 2, 4))):
        _change(root, random)
    return _written(root, content, most)


def cross(first: bytes, second: bytes, most: int, seed: int) -> bytes:
    """Return the first chart with an element of the second in it."""
    random = Random(seed)
    root, other = _read(first), _read(second)
    if root is None or other is None:
        return first[:most]
    part = random.choice(list(other.iter()))
    random.choice(list(root.iter())).append(copy.deepcopy(part))
    return _written(root, first, most)


def _read(content: bytes) -> ET.Element | None:
    if b"<!ENTITY" in content:
        return None
    try:
        return ET.fromstring(content)  # noqa: S314  (no entities)
    except (ET.ParseError, ValueError, LookupError):
        return None


def _written(root: ET.Element, otherwise: bytes, most: int) -> bytes:
    try:
        content = ET.tostring(root, "unicode").encode()
    except (TypeError, ValueError):
        return otherwise[:most]
    return content if len(content) <= most else otherwise[:most]


def _change(root: ET.Element, random: Random) -> None:
    elements = list(root.iter())
    names = sorted({n for e in elements for v in e.attrib.values() for n in NAME.findall(v)})
    element = random.choice(elements)
    match random.randrange(12):
        case 0 | 1 | 2 | 3 if element.attrib:
            name = random.choice(list(element.attrib))
            element.set(name, _value(_local(name), element.get(name, ""), elements, names, random))
        case 4 | 5:
            name = _attribute(element, random)
            if name:
                element.set(name, _value(_local(name), "", elements, names, random))
        case 6 if element.attrib:
            del element.attrib[random.choice(list(element.attrib))]
        case 7 if len(element):
            element.remove(random.choice(list(element)))
        case 8 | 9:
            _insert(element, random, elements, names)
        case 10:
            _move(element, elements, random)
        case _:
            element.text = changed(element.text or "", random, names)


def _move(element: ET.Element, elements: list[ET.Element], random: Random) -> None:
    """Copy an element beside one of its kind, or to any position."""
    kin = [e for e in elements if any(child.tag == element.tag for child in e)]
    parent = random.choice(kin if kin and random.random() < 0.7 else elements)
    moved = copy.deepcopy(element)
    if random.random() < 0.5 and "id" in moved.attrib:
        for one in moved.iter():
            if "id" in one.attrib:
                one.set("id", f"{one.get('id')}{random.randrange(9)}")
    parent.insert(random.randrange(len(parent) + 1), moved)


def _insert(
    element: ET.Element, random: Random, elements: list[ET.Element], names: list[str]
) -> None:
    choices = INSIDE.get(_local(element.tag), ())
    if not choices or random.random() < 0.1:
        choices = (*ATTRIBUTES, *(f"{PREFIX}:{name}" for name in EXTENSION_ELEMENTS))
    new = ET.Element(_qualified(random.choice(sorted(choices))))
    for _ in range(random.randrange(4)):
        name = _attribute(new, random)
        if name:
            new.set(name, _value(_local(name), "", elements, names, random))
    if _local(new.tag) == "transition" and random.random() < 0.5:
        ids = [e.get("id", "") for e in elements if e.get("id")]
        new.set("target", pick(random, ids) or "a")
    element.insert(random.randrange(len(element) + 1), new)


def _attribute(element: ET.Element, random: Random) -> str:
    """Return an attribute that an element can have, or an empty string."""
    local = _local(element.tag)
    if EXTENSION in element.tag:
        choices = sorted(EXTENSION_ELEMENTS.get(local, ()))
    else:
        plain = sorted(ATTRIBUTES.get(local, ()))
        own = sorted(EXTENSION_ATTRIBUTES.get(local, ()))
        choices = [*plain, *(f"{{{EXTENSION}}}{name}" for name in own)]
    return random.choice(choices) if choices else ""


def _value(
    name: str, old: str, elements: list[ET.Element], names: list[str], random: Random
) -> str:
    """Return a value for an attribute: one of its kind, or a modification of the old one."""
    way = random.random()
    if way < 0.3:
        kin = (
            STATE_NAMES if name in STATE_NAMES else EVENT_NAMES if name in EVENT_NAMES else (name,)
        )
        there = [v for e in elements for n, v in e.attrib.items() if _local(n) in kin]
        if there:
            return random.choice(there)
    if way < 0.55 and name in FIXED:
        return random.choice(FIXED[name])
    if way < 0.65 or not old:
        form = random.choice(FORMS) if random.random() < 0.3 else "{}"
        return form.replace("{}", word(random, names)).replace("{{", "{").replace("}}", "}")
    return changed(old, random, names)


def _local(tag: str) -> str:
    return tag.rpartition("}")[2]


def _qualified(word: str) -> str:
    prefix, _, local = word.rpartition(":")
    return f"{{{EXTENSION if prefix else SCXML}}}{local}"
