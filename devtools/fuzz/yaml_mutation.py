"""Changes of charts in YAML that keep them YAML: keys, values, and whole parts."""

from __future__ import annotations

import copy
import re
from collections.abc import Iterator
from random import Random
from typing import Any

import atheris
import yaml

from devtools.fuzz.texts import FORMS, NUMBERS, TYPES, changed, pick, word
from fsmkit.document import keys

Part = Any
"""A text, a list of parts, or parts by key, as the loader without any types gives them."""

BYTES = 0.15
"""Probability of byte mutations, which exercise the notation of YAML."""
NAME = re.compile(r"[^\W\d][\w.-]*")
KEYS = sorted({*keys.CHART, *keys.STATE, *keys.LABELLED, *keys.INVOKE, *keys.DONE, *keys.CAPACITY,
               *keys.EVENTS})  # fmt: skip
TRANSITION: tuple[Part, ...] = (
    "a", {"target": "a", "if": "x == 1"}, {"do": "x = 1"}, ["a", "b"], {"target": "a", "id": "t"},
    {"target": "a", "type": "internal", "do": "raise e"}, [{"if": "x > 0", "target": "b"}, "a"],
    {"target": "b", "override": "true", "first": "true"},
)  # fmt: skip
VALUES: dict[str, tuple[Part, ...]] = {
    "extends": ("base.yaml",),
    "datamodel": ("fsmkit", "ecmascript", "null"),
    "binding": ("early", "late"),
    "types": ({"Fault": ["none", "lost"]}, {"Point": {"x": "0..9", "y": "bool"}}),
    "constants": ({"C": "3"}, {"T": "5ms", "D": "C + 1"}),
    "data": ({"x": "int32 = 0"}, {"l": "uint8[4] = [1, 2, 3, 4]"}, {"f": "float64 = 0.5"},
             {"r": "0..3 = 3"}, {"s": "symbol = 'a'"}, {"d": "duration = 5ms"}),
    "inputs": ({"flag": "bool"}, {"n": "0..9"}),
    "outputs": ({"out": "0..9 = 0"},),
    "operations": (["goto(n 0..9)"], ["ask() -> bool"]),
    "events": ({"in": ["e", "f(n 0..3)"], "out": ["o"], "internal": ["i(v bool)"]},),
    "capacity": ({"queue": "2", "tick": "1ms"}, *({"internal": n} for n in NUMBERS)),
    "script": ("x = 1",),
    "functions": ({"f(n 0..9) -> 0..9": "0 if n == 9 else n"}, {"g() -> bool": "In(a) and x > 1"},
                  {"h(v 0..9) -> bool": "var r 0..10 = v + 1; return r > 2"},
                  {"s(l uint8[4]) -> 0..4": "var n 0..4 = 0; for y in l { n += 1 }; return n"}),
    "use": ("axis.yaml", {"chart": "axis.yaml", "reset": "always"}),
    "with": ({"FAR": "2500"}, {"T_MOVE": "1ms"}),
    "start": ({"tries": "1"}, {"seen": "[0, 3]"}, {"mode": "fast"}),
    "bind": ({"go": "e"}, {"at_far": "x > 0", "goto": "log(position)"}, {"lit": "out"},
             {"arrived": "i"}),
    "entries": ({"in": "a"}, {"in": ["a", "b"]}),
    "exits": ({"there": "a", "jammed": {"target": "b", "do": "x = exit.count"}},),
    "environment": ({"may": ["e", "f", "n in {0, 5}"]}, {"may": ["flag"]}),
    "properties": ({"P": {"reachable": "In(a)"}}, {"N": {"never": "x > 3"}},
                   {"Q": {"leads_to": ["In(a)", "x == 1"]}}),
    "initial": ("a", "b", ["a", "b"], {"target": "a", "do": "x = 1"}),
    "states": ({"a": {}, "b": {"on": {"e": "a"}}}, {"h": {"history": "deep", "default": "a"}}),
    "regions": ({"p": {"initial": "q", "states": {"q": {}}}, "r": {}},),
    "refine": ({"running": {"initial": "a", "states": {"a": {}}}}, {"paused": {"entry": "super"}}),
    "history": ("deep", "shallow"),
    "choice": ([{"if": "x > 0", "target": "a"}, "b"],),
    "done": ({"with": {"n": "x"}}, {"content": "x"}),
    "defer": (["e"], "e"),
    "on": tuple({"e": one} for one in TRANSITION),
    "after": tuple({"5ms": one} for one in TRANSITION),
    "every": tuple({"1s": one} for one in TRANSITION),
    "always": TRANSITION,
    "sometimes": TRANSITION,
    "transitions": ([{"on": "e", "target": "a"}, {"after": "1s", "do": "x = 2"}],),
    "invoke": ([{"src": "x.scxml", "id": "i"}], [{"content": {"states": {"a": {}}}}]),
    "override": (["entry"], ["exit", "initial"], "true"),
    "invariant": ("x < 3", "In(a) or x == 0"),
    **dict.fromkeys(("abstract", "rest", "final", "first", "ordered", "watchdog"), ("true",)),
}  # fmt: skip

Loader = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
Dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)


def mutate(content: bytes, most: int, seed: int) -> bytes:
    """Return a changed chart of at most so many bytes."""
    random = Random(seed)
    root = None if random.random() < BYTES else _read(content)
    if root is None:
        return atheris.Mutate(content, most)
    for _ in range(random.choice((1, 1, 2, 4))):
        _change(root, random)
    return _written(root, content, most, random)


def cross(first: bytes, second: bytes, most: int, seed: int) -> bytes:
    """Return the first chart with a part of the second in it."""
    random = Random(seed)
    root, other = _read(first), _read(second)
    if root is None or other is None:
        return first[:most]
    key, part = random.choice(list(_parts(other)))
    places = [one for _, one in _parts(root) if isinstance(one, dict)]
    random.choice(places)[key if isinstance(key, str) else "on"] = copy.deepcopy(part)
    return _written(root, first, most, random)


def _read(content: bytes) -> dict[Part, Part] | None:
    try:
        root = yaml.load(content, Loader=Loader)  # noqa: S506  (makes texts only)
    except (yaml.YAMLError, ValueError, OverflowError, TypeError, RecursionError):
        return None
    return root if isinstance(root, dict) and len(root) else None


def _written(root: Part, otherwise: bytes, most: int, random: Random) -> bytes:
    style = random.choice((None, False, False, True))
    try:
        text = yaml.dump(
            root, Dumper=Dumper, default_flow_style=style, sort_keys=False, allow_unicode=True,
            width=random.choice((20, 80, 1000)),
            default_style=random.choice((None, None, None, '"')),
        )  # fmt: skip
        content = text.encode()
    except (yaml.YAMLError, ValueError, RecursionError, TypeError):
        return otherwise[:most]
    return content if len(content) <= most else otherwise[:most]


def _parts(root: Part) -> Iterator[tuple[Part, Part]]:
    """Yield each part once, after its key or index; parts may be shared by aliases."""
    seen: set[int] = set()
    open_: list[tuple[Part, Part]] = [("chart", root)]
    while open_:
        key, part = open_.pop()
        if isinstance(part, dict | list):
            if id(part) in seen:
                continue
            seen.add(id(part))
            open_.extend(part.items() if isinstance(part, dict) else enumerate(part))
        yield key, part


def _change(root: dict[Part, Part], random: Random) -> None:
    parts = list(_parts(root))
    names = sorted({n for key, part in parts for text in (key, part) if isinstance(text, str)
                    for n in NAME.findall(text)})  # fmt: skip
    places = [part for _, part in parts if isinstance(part, dict | list)]
    filled = [place for place in places if place]
    place = random.choice(filled or places)
    if not place:
        return
    key = random.choice(list(place) if isinstance(place, dict) else range(len(place)))
    match random.randrange(10):
        case 0 | 1 | 2 | 3:
            place[key] = _value(key, place[key], names, random)
        case 4 | 5:
            mappings = [one for one in places if isinstance(one, dict)]
            chosen = random.choice(KEYS) if random.random() < 0.7 else pick(random, names) or "a"
            random.choice(mappings)[chosen] = _value(chosen, None, names, random)
        case 6:
            del place[key]
        case 7 if isinstance(place, dict):
            renamed = random.choice(KEYS) if random.random() < 0.4 else word(random, names)
            items = [(renamed if k == key else k, v) for k, v in place.items()]
            place.clear()
            place.update(items)
        case 8:
            part = copy.deepcopy(random.choice(parts)[1])
            place[key] = part if part is not root else ""
        case _:
            kin = [part for other, part in parts if other == key and isinstance(part, dict | list)]
            if kin and isinstance(place[key], dict):
                place[key] = copy.deepcopy(random.choice(kin))
            else:
                place[key] = [place[key], _value(key, None, names, random)]


def _value(key: Part, old: Part, names: list[str], random: Random) -> Part:
    if key in VALUES and random.random() < 0.5:
        return copy.deepcopy(random.choice(VALUES[key]))
    if isinstance(old, str) and random.random() < 0.8:
        return changed(old, random, names)
    if isinstance(old, dict | list) and random.random() < 0.5:
        return [old] if isinstance(old, dict) else {str(n): part for n, part in enumerate(old)}
    if random.random() < 0.3:
        return f"{random.choice(TYPES)} = {word(random, names)}"
    form = random.choice(FORMS) if random.random() < 0.4 else "{}"
    return form.replace("{}", word(random, names)).replace("{{", "{").replace("}}", "}")
