"""The rules that UPPAAL enforces only when it runs, or not at all (FORMATS; docs.uppaal.org).

Names are legal, not reserved and unique in their scope; ids are unique in the file; ends of edges
exist; start values lie in their ranges; what is read is declared. Clocks: invariants bound them
from above, guards compare them with whole numbers outside any disjunction and not on edges that
synchronise on an urgent channel or receive; updates set them to whole numbers.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from fsmkit.export.uppaal.names import RESERVED
from fsmkit.export.uppaal.network import (
    Declarations,
    Declared,
    Edge,
    Function,
    Network,
    Sort,
    Template,
)
from fsmkit.export.uppaal.terms import GREATEST, LEAST
from tests.export.uppaal_reading import innermost

WORD = re.compile(r"(?<![\w.])[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)?")
WORDS = frozenset({"true", "false"})
UPPER = re.compile(r"\w+ <=? \d+")
COMPARED = re.compile(r"\w+ (<|<=|>=|>|==) \d+")
RESET = re.compile(r"\w+ = \d+")


def problems(network: Network) -> Iterator[str]:
    """Yield the rules that a network breaks."""
    instances = [t.instance for t in network.templates]
    outer = [*_names(network.declarations), *(t.name for t in network.templates), *instances]
    yield from _unique(outer, "the declarations")
    yield from _values(network.declarations)
    if not network.templates:
        yield "there is no template"
    ids = [location.id for template in network.templates for location in template.locations]
    if len(set(ids)) != len(ids):
        yield "two locations have one id"
    for template in network.templates:
        yield from _of_template(network, template, set(outer))
    yield from _of_queries(network, set(_names(network.declarations)))


def _names(declarations: Declarations) -> list[str]:
    return [one.name for one in declarations]


def _unique(names: Iterable[str], where: str) -> Iterator[str]:
    seen: set[str] = set()
    for name in names:
        if not re.fullmatch(r"[A-Za-z_]\w*", name, re.ASCII) or name in RESERVED:
            yield f"`{name}` in {where} is no name"
        if name in seen:
            yield f"`{name}` is declared twice in {where}"
        seen.add(name)


def _values(declarations: Declarations) -> Iterator[str]:
    for one in declarations:
        if isinstance(one, Function):
            continue
        lo, hi = (0, 1) if one.sort is Sort.BOOL else (one.lo, one.hi)
        if not LEAST <= lo <= hi <= GREATEST:
            yield f"the range of `{one.name}` is beyond 32 bits"
        if one.init and len(one.init) != max(1, one.length):
            yield f"`{one.name}` has {one.length} elements and {len(one.init)} start values"
        if any(not lo <= value <= hi for value in one.init):
            yield f"a start value of `{one.name}` is outside {lo}..{hi}"
        if one.sort in (Sort.INT, Sort.BOOL) and not one.init:
            yield f"`{one.name}` has no start value"


def _of_template(network: Network, template: Template, outer: set[str]) -> Iterator[str]:
    own = _names(template.declarations)
    where = f"`{template.name}`"
    yield from _unique([*own, *(loc.name for loc in template.locations if loc.name)], where)
    yield from (f"`{name}` in {where} hides another" for name in own if name in outer)
    yield from _values(template.declarations)
    ids = [location.id for location in template.locations]
    if template.initial not in ids:
        yield f"{where} has no initial location"
    both = (*network.declarations, *template.declarations)
    clocks = {o.name for o in both if isinstance(o, Declared) and o.sort is Sort.CLOCK}
    known = set(_names(both))
    for location in template.locations:
        if location.committed and location.invariant:
            yield f"a committed location of {where} has an invariant"
        for part in innermost(location.invariant):
            if used_clocks(part, clocks) and not UPPER.fullmatch(part):
                yield f"the invariant `{part}` does not bound a clock from above"
            used = set(WORD.findall(part)) - WORDS
            yield from (f"`{w}` is not declared: `{part}`" for w in used - known)
    for edge in template.edges:
        if edge.source not in ids or edge.target not in ids:
            yield f"an edge of {where} has no end"
        yield from _of_edge(edge, known, clocks, both)


def _of_edge(edge: Edge, known: set[str], clocks: set[str], both: Declarations) -> Iterator[str]:
    selected = [name for name, _, _ in edge.select]
    yield from _unique(selected, "a selection")
    yield from (f"`{name}` is selected and declared" for name in selected if name in known)
    for part in (*edge.guard, *edge.update):
        used = set(WORD.findall(part)) - WORDS
        yield from (f"`{w}` is not declared: `{part}`" for w in used - known - {*selected})
    channels = {o.name: o.sort for o in both if isinstance(o, Declared) and "chan" in o.sort.value}
    is_urgent = channels.get(edge.sync[:-1]) is Sort.URGENT_BROADCAST
    for part in innermost(edge.guard):
        if used_clocks(part, clocks):
            if not COMPARED.fullmatch(part):
                yield f"the guard `{part}` compares a clock inside something else"
            if is_urgent:
                yield f"the guard `{part}` stands beside an urgent channel"
            if edge.sync.endswith("?"):
                yield f"the guard `{part}` stands where a broadcast is received"
        if re.search(r"(?<![=!<>])=(?!=)", part):
            yield f"the guard `{part}` stores something"
    yield from (
        f"`{part}` sets a clock to what is no whole number"
        for part in edge.update
        if used_clocks(part, clocks) and not RESET.fullmatch(part)
    )
    constants = {o.name for o in both if isinstance(o, Declared) and o.constant}
    for part in edge.update:
        if re.split(r"[\[ ]", part)[0] in constants:
            yield f"`{part}` changes a constant"
    if edge.sync and not (edge.sync[-1] in "!?" and edge.sync[:-1] in channels):
        yield f"`{edge.sync}` is no channel"


def used_clocks(text: str, clocks: set[str]) -> set[str]:
    """Return the clocks that a text names."""
    return set(WORD.findall(text)) & clocks


def _of_queries(network: Network, known: set[str]) -> Iterator[str]:
    inner = {
        f"{template.instance}.{name}"
        for template in network.templates
        for name in (
            *_names(template.declarations),
            *(location.name for location in template.locations if location.name),
        )
    }
    for query in network.queries:
        text = re.sub(r"^(A\[\]|E<>)", "", query.formula)
        for word in set(WORD.findall(text)) - WORDS - known - inner:
            yield f"`{word}` in the query `{query.formula}` is not declared"
