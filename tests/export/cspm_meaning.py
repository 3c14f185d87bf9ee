"""What the CSPm that is written means: the steps of its processes.

The rules are those of the operational semantics of CSP (A. W. Roscoe, Understanding Concurrent
Systems, 2010, chapter 9), for the operators that are written.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from itertools import product
from typing import Any

from tests.export.cspm_text import Ast, NotOfSubset, Parser

TAU = ("tau",)
NEVER_REFUSES_TOCK = (
    Parser("P = (CHAOS(diff(Events, {tock})) ||| RUN({tock}))").parse().equations["P"][0][1]
)
"""Anything may happen, and be refused but for `tock`; nothing diverges."""
Event = tuple[Any, ...]
Process = tuple[Any, ...]

FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "length": len,
    "null": lambda s: len(s) == 0,
    "head": lambda s: s[0],
    "tail": lambda s: s[1:],
    "diff": lambda a, b: a - b,
    "member": lambda x, s: x in s,
    "Union": lambda sets: frozenset().union(*sets),
}


class Meaning:
    """Evaluates expressions, and takes the steps of processes.

    A process is ``("ref", name, arguments)`` of an equation that only offers, ``("stop",)``, or an
    operator over such: ``("parallel", alphabets, parts)``, ``("share", left, events, right)``,
    ``("hide", inner, events)``, ``("rename", inner, pairs)``.
    """

    def __init__(self, text: str) -> None:
        self.script = Parser(text).parse()
        constructors = [c for found in self.script.constructors.values() for c in found]
        self.constants: dict[str, Any] = {c: c for c in constructors}
        self.events = frozenset(
            event for channel in self.script.channels for event in self.productions((channel,))
        )
        self.sets: dict[str, Any] = {}
        self.offers = cache(self._offers)
        self.alphabets: dict[Process, list[frozenset[Event]]] = {}

    def productions(self, prefix: Event) -> frozenset[Event]:
        fields = [self.type_of(f) for f in self.script.channels[prefix[0]]]
        if any(v not in values for v, values in zip(prefix[1:], fields, strict=False)):
            raise NotOfSubset(f"not of the channel: {prefix}")
        if len(prefix) > 1 + len(fields):
            raise NotOfSubset(f"too long: {prefix}")
        rest = product(*(sorted(values) for values in fields[len(prefix) - 1 :]))
        return frozenset((*prefix, *values) for values in rest)

    def type_of(self, ast: Ast) -> frozenset[Any]:
        if ast[0] == "name" and ast[1] in self.script.constructors:
            return frozenset(self.script.constructors[ast[1]])
        value = self.value(ast, {})
        assert isinstance(value, frozenset)
        return value

    # --- values ----------------------------------------------------------------------------------

    def value(self, ast: Ast, env: Mapping[str, Any]) -> Any:
        match ast:
            case ("number", number):
                return number
            case ("name", str(name)):
                return self.named(name, env)
            case ("call", str(name), *arguments):
                values = [self.value(a, env) for a in arguments]
                if name in FUNCTIONS and name not in self.script.equations:
                    return FUNCTIONS[name](*values)
                inner, body = self.equation(name, values)
                return self.value(body, inner)
            case ("dot", left, right):
                event = self.value(left, env)
                assert isinstance(event, tuple)
                return (*event, self.value(right, env))
            case ("range", first, last):
                return frozenset(range(self.value(first, env), self.value(last, env) + 1))
            case ("set", *members):
                values = [self.value(m, env) for m in members]
                for v in values:
                    if isinstance(v, tuple) and not isinstance(v, Seq) and v not in self.events:
                        raise NotOfSubset(f"not an event: {v}")
                return frozenset(values)
            case ("productions", *members):
                found = (self.productions(self.value(m, env)) for m in members)
                return frozenset().union(*found)
            case ("sequence", *members):
                return Seq(self.value(m, env) for m in members)
            case ("^", left, right):
                return Seq((*self.value(left, env), *self.value(right, env)))
            case ("==", left, right):
                return self.value(left, env) == self.value(right, env)
            case ("<", left, right):
                return self.value(left, env) < self.value(right, env)
            case ("not", inner_):
                return not self.value(inner_, env)
            case ("if", test, yes, no):
                return self.value(yes if self.value(test, env) else no, env)
        raise NotOfSubset(f"not a value: {ast}")

    def named(self, name: str, env: Mapping[str, Any]) -> Any:
        if name in env:
            return env[name]
        if name in self.constants:
            return self.constants[name]
        if name in self.script.channels:
            return (name,)
        if name == "Events":
            return self.events
        if name not in self.sets:
            self.sets[name] = self.value(self.equation(name, [])[1], {})
        return self.sets[name]

    def equation(self, name: str, values: list[Any]) -> tuple[dict[str, Any], Ast]:
        if name not in self.script.equations:
            raise NotOfSubset(f"undefined: {name}")
        for parameters, body in self.script.equations[name]:
            if len(parameters) != len(values):
                raise NotOfSubset(f"arguments of {name}")
            env = {}
            for parameter, value in zip(parameters, values, strict=True):
                if parameter[0] == "name":
                    env[parameter[1]] = value
                elif parameter != ("number", value):
                    break
            else:
                return env, body
        raise NotOfSubset(f"no equation: {name}{tuple(values)}")

    # --- processes -------------------------------------------------------------------------------

    def process(self, ast: Ast, env: Mapping[str, Any]) -> Process:
        match ast:
            case ("name", "STOP"):
                return ("stop",)
            case ("name", str(name)):
                return self.reference(name, [])
            case ("call", str(name), *arguments):
                return self.reference(name, [self.value(a, env) for a in arguments])
            case ("parallel", variable, over, alphabet, part):
                members = sorted(self.value(over, env))
                inner = [{**env, variable: member} for member in members]
                alphabets = tuple(self.value(alphabet, e) for e in inner)
                return ("parallel", alphabets, tuple(self.process(part, e) for e in inner))
            case ("share", left, shared, right):
                events = self.value(shared, env)
                return ("share", self.process(left, env), events, self.process(right, env))
            case ("\\", inner_, hidden):
                return ("hide", self.process(inner_, env), self.value(hidden, env))
            case ("rename", inner_, pairs):
                renamed: dict[Event, list[Event]] = {}
                for old, new in pairs:
                    renamed.setdefault(self.event(old, env), []).append(self.event(new, env))
                frozen = tuple((old, tuple(new)) for old, new in renamed.items())
                return ("rename", self.process(inner_, env), frozen)
        raise NotOfSubset(f"not a process: {ast}")

    def reference(self, name: str, values: list[Any]) -> Process:
        env, body = self.equation(name, values)
        while body[0] == "if":
            body = body[2] if self.value(body[1], env) else body[3]
        if body != ("name", "STOP") and body[0] in (
            "parallel",
            "share",
            "\\",
            "rename",
            "name",
            "call",
        ):
            return self.process(body, env)
        return ("ref", name, tuple(values))

    def event(self, ast: Ast, env: Mapping[str, Any]) -> Event:
        event = self.value(ast, env)
        if event not in self.events:
            raise NotOfSubset(f"not an event: {event}")
        assert isinstance(event, tuple)
        return event

    def _offers(self, process: Process) -> Mapping[Event, tuple[Process, ...]]:
        """Return what an equation that only offers does, by event."""
        found: dict[Event, dict[Process, None]] = {}
        if process != ("stop",):
            env, body = self.equation(process[1], list(process[2]))
            for event, to in self.choices(body, env):
                found.setdefault(event, {})[to] = None
        return {event: tuple(to) for event, to in found.items()}

    def choices(self, ast: Ast, env: Mapping[str, Any]) -> Iterator[tuple[Event, Process]]:
        match ast:
            case ("name", "STOP"):
                return
            case ("[]", left, right):
                yield from self.choices(left, env)
                yield from self.choices(right, env)
            case ("->", event, to):
                yield self.event(event, env), self.process(to, env)
            case ("&", test, inner):
                if self.value(test, env):
                    yield from self.choices(inner, env)
            case ("each", variable, over, inner):
                for member in self.value(over, env):
                    yield from self.choices(inner, {**env, variable: member})
            case _:
                raise NotOfSubset(f"not offered: {ast}")

    def steps(self, process: Process) -> Iterator[tuple[Event, Process]]:
        match process:
            case ("parallel", alphabets, parts):
                yield from self._together(alphabets, parts)
            case ("share", left, shared, right):
                for event, to in self.steps(left):
                    if event not in shared:
                        yield event, ("share", to, shared, right)
                        continue
                    for other, along in self.steps(right):
                        if other == event:
                            yield event, ("share", to, shared, along)
                for event, to in self.steps(right):
                    if event not in shared:
                        yield event, ("share", left, shared, to)
            case ("hide", inner, hidden):
                for event, to in self.steps(inner):
                    yield TAU if event in hidden else event, ("hide", to, hidden)
            case ("rename", inner, pairs):
                renamed = dict(pairs)
                for event, to in self.steps(inner):
                    for new in renamed.get(event, (event,)):
                        yield new, ("rename", to, pairs)
            case _:
                for event, targets in self.offers(process).items():
                    for to in targets:
                        yield event, to

    def _together(
        self, alphabets: tuple[frozenset[Event], ...], parts: tuple[Process, ...]
    ) -> Iterator[tuple[Event, Process]]:
        """A step of all that have the event in their alphabets; the parts only offer."""
        offered = [self.offers(part) for part in parts]
        for event in dict.fromkeys(e for found in offered for e in found):
            ways: list[tuple[Process, ...]] = []
            for part, alphabet, found in zip(parts, alphabets, offered, strict=True):
                if event not in alphabet:
                    if event in found:
                        raise NotOfSubset(f"offered outside of the alphabet: {event}")
                    ways.append((part,))
                else:
                    ways.append(found.get(event, ()))
            for to in product(*ways):
                yield event, ("parallel", alphabets, to)

    # --- exploring -------------------------------------------------------------------------------

    def graph(self, process: Process, most: int) -> list[list[tuple[Event, int]]]:
        """Return all states from a process on, which is number 0."""
        numbers = {process: 0}
        order = [process]
        graph: list[list[tuple[Event, int]]] = []
        while len(graph) < len(order):
            steps = []
            for event, to in self.steps(order[len(graph)]):
                if to not in numbers:
                    numbers[to] = len(order)
                    order.append(to)
                    assert len(order) <= most
                steps.append((event, numbers[to]))
            graph.append(steps)
        return graph

    def holds(self, assertion: tuple[bool, str, Ast, Ast], most: int) -> bool:
        """Decide an assertion: a refinement, no divergence, or no deadlock."""
        wanted, kind, left, right = assertion
        if kind == "[T=":
            spec, process = (self.graph(self.process(side, {}), most) for side in (left, right))
            return wanted is can_follow(spec, process)
        if kind == "[FD=":
            assert self.equation(str(left[1]), [])[1] == NEVER_REFUSES_TOCK
            graph = self.graph(self.process(right, {}), most)
            inner = [[to for event, to in steps if event == TAU] for steps in graph]
            offers = (any(e in (("tock",), TAU) for e, _ in steps) for steps in graph)
            return wanted is (all(offers) and not has_cycle(inner))
        graph = self.graph(self.process(left, {}), most)
        if kind.startswith(":[divergence"):
            return wanted is not has_cycle(
                [[to for event, to in steps if event == TAU] for steps in graph]
            )
        return wanted is all(graph)


class Seq(tuple[Any, ...]):
    """A sequence, which is no event."""

    __slots__ = ()

    def __getitem__(self, at: Any) -> Any:
        found = super().__getitem__(at)
        return Seq(found) if isinstance(at, slice) else found


def can_follow(spec: list[list[tuple[Event, int]]], process: list[list[tuple[Event, int]]]) -> bool:
    """Whether each trace of a process is one of another: by subsets of states of that."""

    def quiet(states: Iterable[int]) -> frozenset[int]:
        found = set(states)
        ahead = list(found)
        while ahead:
            for event, to in spec[ahead.pop()]:
                if event == TAU and to not in found:
                    found.add(to)
                    ahead.append(to)
        return frozenset(found)

    begin = (0, quiet({0}))
    seen = {begin}
    ahead = [begin]
    while ahead:
        at, inside = ahead.pop()
        for event, to in process[at]:
            allowed = inside
            if event != TAU:
                allowed = quiet(s for state in inside for e, s in spec[state] if e == event)
            if not allowed:
                return False
            if (to, allowed) not in seen:
                seen.add((to, allowed))
                ahead.append((to, allowed))
    return True


def has_cycle(graph: list[list[int]]) -> bool:
    """Whether a graph has a cycle: what remains when what has no arrow in is taken away."""
    inward = [0] * len(graph)
    for steps in graph:
        for to in steps:
            inward[to] += 1
    waiting = [state for state, count in enumerate(inward) if not count]
    gone = 0
    while waiting:
        gone += 1
        for to in graph[waiting.pop()]:
            inward[to] -= 1
            if not inward[to]:
                waiting.append(to)
    return gone < len(graph)


def bisimilar(one: list[list[tuple[str, int]]], other: list[list[tuple[str, int]]]) -> bool:
    """Whether states 0 of two graphs are strongly bisimilar, by refinement of partitions."""
    graph = [*one, *([(label, to + len(one)) for label, to in steps] for steps in other)]
    block = [0] * len(graph)
    count = 1
    while True:
        numbers: dict[object, int] = {}
        found = [
            numbers.setdefault((block[state], frozenset((label, block[to]) for label, to in steps)),
                               len(numbers))
            for state, steps in enumerate(graph)
        ]  # fmt: skip
        block = found
        if len(numbers) == count:
            return block[0] == block[len(one)]
        count = len(numbers)


def relabelled(
    graph: Iterable[Iterable[tuple[Event, int]]], label: Callable[[Event], str]
) -> list[list[tuple[str, int]]]:
    return [[(label(event), to) for event, to in steps] for steps in graph]
