"""What a network means, untimed or in discrete time: a small interpreter of the flat form.

It knows nothing of charts: locations, variables, clocks, urgent, committed and broadcast are
UPPAAL's (docs.uppaal.org, Semantics). Leaving the bounds of a variable is an error, as it is there.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache, partial
from typing import Any

from lark import Lark, Token, Transformer

from fsmkit.export.uppaal.network import Declared, Edge, Network, Sort

GRAMMAR = r"""
?start: assignment | expr
assignment: place "=" expr
place: NAME ("[" expr "]")?
?expr: or_ | or_ "?" expr ":" expr -> choice
?or_: and_ | or_ "||" and_ -> either
?and_: bor | and_ "&&" bor -> both
?bor: bxor | bor "|" bxor -> bit_or
?bxor: band | bxor "^" band -> bit_xor
?band: eq | band "&" eq -> bit_and
?eq: cmp | eq "==" cmp -> eq | eq "!=" cmp -> ne
?cmp: shift | cmp "<" shift -> lt | cmp "<=" shift -> le
     | cmp ">" shift -> gt | cmp ">=" shift -> ge
?shift: sum | shift "<<" sum -> shl | shift ">>" sum -> shr
?sum: product | sum "+" product -> add | sum "-" product -> sub
?product: unary | product "*" unary -> mul | product "/" unary -> div | product "%" unary -> rem
?unary: atom | "!" unary -> not_ | "-" unary -> neg
?atom: "(" expr ")" | NUMBER -> number | "true" -> true | "false" -> false
     | NAME "[" expr "]" -> element | NAME -> name | NAME "." NAME -> member
NAME: /(?!(true|false)\b)[A-Za-z_]\w*/
NUMBER: /\d+/
%ignore " "
"""
PARSER = Lark(GRAMMAR, parser="lalr")


@cache
def parsed(text: str) -> Any:
    return PARSER.parse(text)


def quotient(a: int, b: int) -> int:
    magnitude = abs(a) // abs(b)
    return magnitude if (a < 0) == (b < 0) else -magnitude


def remainder(a: int, b: int) -> int:
    return a - b * quotient(a, b)


def element(s: list[int], start: int, length: int, at: int) -> int:
    assert 0 <= at < length, "an index outside its array"
    return s[start + at]


class ToPython(Transformer[Token, str]):
    """Turns a tree into Python over a list ``s``."""

    def __init__(self, resolve: Callable[[str], str], place: Callable[[str], tuple[int, Declared]],
                 member: Callable[[str, str], str]) -> None:  # fmt: skip
        super().__init__()
        self._resolve, self._place, self._member = resolve, place, member

    def number(self, t: list[str]) -> str:
        return str(t[0])

    def true(self, _: list[str]) -> str:
        return "True"

    def false(self, _: list[str]) -> str:
        return "False"

    def name(self, t: list[str]) -> str:
        return self._resolve(str(t[0]))

    def member(self, t: list[str]) -> str:
        return self._member(str(t[0]), str(t[1]))

    def element(self, t: list[str]) -> str:
        start, one = self._place(str(t[0]))
        if one.constant:
            return f"{one.init!r}[{t[1]}]"
        return f"element(s, {start}, {one.length}, {t[1]})"

    def choice(self, t: list[str]) -> str:
        return f"({t[1]} if {t[0]} else {t[2]})"

    def not_(self, t: list[str]) -> str:
        return f"(not {t[0]})"

    def neg(self, t: list[str]) -> str:
        return f"(-{t[0]})"

    def div(self, t: list[str]) -> str:
        return f"quotient({t[0]}, {t[1]})"

    def rem(self, t: list[str]) -> str:
        return f"remainder({t[0]}, {t[1]})"

    def place(self, t: list[str]) -> str:
        start, one = self._place(str(t[0]))
        assert not one.constant
        if len(t) == 1:
            return f"{start}"
        return f"{start} + within({t[1]}, {one.length})"

    def assignment(self, t: list[str]) -> str:
        return f"s[{t[0]}] = {t[1]}"


INFIX = {
    "either": "or", "both": "and", "bit_or": "|", "bit_xor": "^", "bit_and": "&", "eq": "==",
    "ne": "!=", "lt": "<", "le": "<=", "gt": ">", "ge": ">=", "shl": "<<", "shr": ">>",
    "add": "+", "sub": "-", "mul": "*",
}  # fmt: skip
for _name, _op in INFIX.items():
    setattr(ToPython, _name, lambda _, t, op=_op: f"({t[0]} {op} {t[1]})")


def within(at: int, length: int) -> int:
    assert 0 <= at < length, "an index outside its array"
    return at


def bounded(value: int, lo: int, hi: int, name: str) -> int:
    assert lo <= value <= hi, f"{name} = {value} is outside {lo}..{hi}"
    return int(value)


@dataclass
class Compiled:
    target: int
    guard: Callable[[list[int]], bool]
    sync: str
    is_urgent: bool
    edge: Edge
    chosen: dict[str, int]


@dataclass
class Meaning:
    """A network ready to run. A state: locations, then variables, then clocks."""

    network: Network
    unit: int = 0
    places: dict[tuple[int, str], tuple[int, Declared]] = field(default_factory=dict)
    """By template (-1: the global ones) and name."""
    start: list[int] = field(default_factory=list)
    channels: dict[str, Sort] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.start = [0] * len(self.network.templates)
        for scope, declarations in enumerate(
            [self.network.declarations, *(t.declarations for t in self.network.templates)], -1
        ):
            for one in declarations:
                assert isinstance(one, Declared), "the flat form has no functions"
                if one.sort in (Sort.URGENT_BROADCAST, Sort.BROADCAST):
                    self.channels[one.name] = one.sort
                    continue
                self.places[scope, one.name] = len(self.start), one
                if not one.constant:
                    self.start += list(one.init) or [0] * max(1, one.length)
        self.clocks = [at for at, one in self.places.values() if one.sort is Sort.CLOCK]
        self.numbers = [
            {loc.id: n for n, loc in enumerate(t.locations)} for t in self.network.templates
        ]
        for number, template in enumerate(self.network.templates):
            self.start[number] = self.numbers[number][template.initial]
        self._compile()

    # --- compiling ---

    def _find(self, scope: int, name: str) -> tuple[int, Declared]:
        found = self.places.get((scope, name)) or self.places.get((-1, name))
        assert found is not None, f"{name} is not declared"
        return found

    def python(self, text: str, scope: int, select: dict[str, int]) -> str:
        def resolve(name: str) -> str:
            if name in select:
                return str(select[name])
            at, one = self._find(scope, name)
            return str(one.init[0]) if one.constant else f"s[{at}]"

        def member(instance: str, name: str) -> str:
            number = next(n for n, t in enumerate(self.network.templates) if t.instance == instance)
            for place, location in enumerate(self.network.templates[number].locations):
                if location.name == name:
                    return f"(s[{number}] == {place})"
            return f"s[{self.places[number, name][0]}]"

        tree = parsed(text)
        make = ToPython(resolve, lambda name: self._find(scope, name), member)
        if getattr(tree, "data", "") == "assignment":
            target = str(tree.children[0].children[0])
            _, one = self._find(scope, target)
            left, _, right = make.transform(tree).partition(" = ")
            if one.sort is Sort.INT:
                right = f"bounded({right}, {one.lo}, {one.hi}, {target!r})"
            return f"{left} = {right}"
        if isinstance(tree, Token):
            return resolve(str(tree))
        return str(make.transform(tree))

    def function(self, body: str) -> Callable[[list[int]], Any]:
        scope = {"element": element, "quotient": quotient, "remainder": remainder,
                 "within": within, "bounded": bounded}  # fmt: skip
        exec(f"def f(s):\n{body}", scope)
        return scope["f"]  # type: ignore[return-value]

    def condition(self, parts: tuple[str, ...], scope: int, select: dict[str, int]) -> Any:
        text = " and ".join(f"({self.python(p, scope, select)})" for p in parts) or "True"
        return self.function(f"  return {text}")

    def _compile(self) -> None:
        self.edges: list[list[list[Compiled]]] = []
        self.invariants: list[list[Any]] = []
        self.committed: list[list[bool]] = []
        self.urgent: list[list[bool]] = []
        self.active: list[list[frozenset[int]]] = []
        made: dict[Any, Any] = {}

        def once(key: Any, make: Callable[[], Any]) -> Any:
            if key not in made:
                made[key] = make()
            return made[key]

        for n, template in enumerate(self.network.templates):
            out: list[list[Compiled]] = [[] for _ in template.locations]
            names = {at: name for (scope, name), (at, _) in self.places.items()
                     if scope == n and at in self.clocks}  # fmt: skip
            texts = [" ".join(loc.invariant) for loc in template.locations]
            for edge in template.edges:
                source = self.numbers[n][edge.source]
                texts[source] += " " + " ".join(edge.guard)
                for chosen in selections(edge):
                    frozen = tuple(chosen.items())
                    make = partial(self.condition, edge.guard, n, chosen)
                    guard = once((n, edge.guard, frozen), make)
                    target = self.numbers[n][edge.target]
                    urgent = self.channels.get(edge.sync[:-1]) is Sort.URGENT_BROADCAST
                    one = Compiled(target, guard, edge.sync, urgent, edge, chosen)
                    out[source].append(one)
            self.edges.append(out)
            self.invariants.append([self.condition(loc.invariant, n, {}) if loc.invariant else None
                                    for loc in template.locations])  # fmt: skip
            self.committed.append([loc.committed for loc in template.locations])
            self.urgent.append([loc.urgent for loc in template.locations])
            self.active.append([
                frozenset(at for at, name in names.items() if re.search(rf"\b{name}\b", text))
                for text in texts
            ])  # fmt: skip
        numbers = [int(x) for t in self.network.templates for loc in t.locations
                   for x in re.findall(r"= (\d+)", " ".join(loc.invariant))]  # fmt: skip
        numbers += [int(x) for t in self.network.templates for e in t.edges for g in e.guard
                    for x in re.findall(r"[<>]=? (\d+)", g)]  # fmt: skip
        self.most = max(numbers, default=0) + self.unit
        self.bound = [n for n, of in enumerate(self.invariants) if any(of)]
        self.moves = [[self._moves(n, of) for of in out] for n, out in enumerate(self.edges)]

    def _moves(self, n: int, edges: list[Compiled]) -> Any:
        """Return one function of all edges of a location; it returns the states after them."""
        lines = ["  found = []"]
        for edge in edges:
            if edge.sync.endswith("?"):
                continue
            chosen = edge.chosen
            guard = " and ".join(f"({self.python(p, n, chosen)})" for p in edge.edge.guard)
            lines += [f"  if {guard or 'True'}:", "    a = list(s)"]
            lines += [f"    {text}" for text in self._updates(n, edge)]
            for other, source, heard in self._receivers(n, edge):
                lines += [f"    if s[{other}] == {source}:"]
                lines += [f"      {text}" for text in self._updates(other, heard)]
            lines += ["    found.append(a)"]
        return self.function("\n".join([*lines, "  return found"]))

    def _updates(self, n: int, edge: Compiled) -> Iterator[str]:
        """Yield what taking an edge does to a state ``a``."""
        for part in edge.edge.update:
            yield re.sub(r"\bs([\[,])", r"a\1", self.python(part, n, edge.chosen))
        yield f"a[{n}] = {edge.target}"

    def _receivers(self, n: int, edge: Compiled) -> Iterator[tuple[int, int, Compiled]]:
        """Yield who takes part in a broadcast, by template and location, in their order."""
        if not edge.sync:
            return
        for other, of in enumerate(self.edges):
            for source, edges in enumerate(of):
                heard = [one for one in edges if one.sync == f"{edge.sync[:-1]}?"]
                assert len(heard) <= 1, "a choice between receptions is not written"
                if other != n and heard:
                    assert not heard[0].edge.guard, "a reception with a guard is not written"
                    yield other, source, heard[0]

    # --- running ---

    def without_time(self, s: tuple[int, ...]) -> tuple[int, ...]:
        """Return a state without what lets time pass in the flat form, if anything does."""
        templates = [t.name for t in self.network.templates]
        if "Time" not in templates:
            return s
        hidden = templates.index("Time"), self.places[-1, "calm"][0]
        return tuple(value for at, value in enumerate(s) if at not in hidden)

    def is_committed(self, s: tuple[int, ...]) -> bool:
        return any(of[s[n]] for n, of in enumerate(self.committed))

    def untimed(self, s: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
        """Yield what follows where there are no clocks, and hurry has no meaning."""
        committed = self.is_committed(s)
        for n, of in enumerate(self.moves):
            if not committed or self.committed[n][s[n]]:
                yield from (tuple(after) for after in of[s[n]](s) if self._allowed(after))

    def successors(self, s: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
        committed = self.is_committed(s)
        state = list(s)
        urgent = any(of[s[n]] for n, of in enumerate(self.urgent))
        for n, of in enumerate(self.edges):
            if committed and not self.committed[n][s[n]]:
                continue
            for edge in of[s[n]]:
                if edge.is_urgent and edge.guard(state):
                    urgent = True
            yield from (self._settled(a) for a in self.moves[n][s[n]](s) if self._allowed(a))
        if not committed and not urgent and self.unit:
            after = list(s)
            for clock in self.clocks:
                after[clock] = min(after[clock] + self.unit, self.most)
            if self._allowed(after):
                yield self._settled(after)

    def _allowed(self, s: list[int]) -> bool:
        return all(
            self.invariants[n][s[n]] is None or self.invariants[n][s[n]](s) for n in self.bound
        )

    def _settled(self, s: list[int]) -> tuple[int, ...]:
        if self.clocks:
            used: set[int] = set()
            for n, of in enumerate(self.active):
                if self.committed[n][s[n]]:
                    used.update(at for (scope, _), (at, _) in self.places.items() if scope == n)
                used |= of[s[n]]
            for clock in self.clocks:
                if clock not in used:
                    s[clock] = 0
        return tuple(int(x) for x in s)

    def reached(self, most: int = 10**6) -> list[tuple[int, ...]]:
        after_it = self.successors if self.clocks else self.untimed
        first = tuple(self.start)
        seen = {first}
        order = [first]
        for s in order:
            for after in after_it(s):
                if after not in seen:
                    seen.add(after)
                    order.append(after)
            assert len(order) <= most, "too many states"
        return order

    def verdict(self, formula: str, states: list[tuple[int, ...]]) -> bool:
        """Whether a query ``A[] p`` or ``E<> p`` holds."""
        kind, text = formula[:3], formula[4:]
        holds = self.condition((text,), -1, {})
        if kind == "A[]":
            return all(holds(s) for s in states)
        assert kind == "E<>"
        return any(holds(s) for s in states)


def selections(edge: Edge) -> Iterator[dict[str, int]]:
    def rest(names: tuple[tuple[str, int, int], ...]) -> Iterator[dict[str, int]]:
        if not names:
            yield {}
            return
        (name, lo, hi), *others = names
        for value in range(lo, hi + 1):
            for more in rest(tuple(others)):
                yield {name: value, **more}

    yield from rest(edge.select)
