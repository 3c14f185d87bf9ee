"""Scripts: the calls of a host line by line, with the same effect on every runtime.

Lines: ``start NOW``, ``post EVENT v1 v2``, ``dispatch EVENT v1``, ``ask EVENT v1`` (a dispatch
that also returns how it was handled), ``input NAME VALUE``, ``run NOW``, ``at NOW`` (the time of
the next ``dispatch``), ``within N EVENT v1`` (the Nth next call of an operation posts the event),
``returns OPERATION v1 v2`` (the next results of an operation, one per call; the last one repeats),
``seed N``, ``dump``, ``save``, ``restore NOW`` (a new machine replaces the one that was saved
last), and ``restore NOW BYTES``. Times are ticks modulo 2^32.
Other operations return pseudo-random values, equal in every harness: values of their ``from`` list
if they have one, else any value of their type.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import assert_never

import fsmkit.language as lang
from fsmkit.chart.chart import Chart, Event, every_operation, result_types
from fsmkit.diagnostics import FsmkitError, Source, Span, Text, fail
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.document.document import Direction
from fsmkit.language.units import duration_text, read_microseconds
from fsmkit.language.values import part_types, read_value, tokens
from fsmkit.runtime import interpreter, snapshot_bytes
from fsmkit.runtime.interpreter.snapshot import Macrostep, Occurrence, Post
from fsmkit.runtime.interpreter.trace import CLOCK, dump_lines, trace_lines, value_text

NOTHING = Occurrence(0, ())
"""The event of a line that has none."""
LONGEST_WAIT = 2**48
"""Ticks of one wait: 8,900 years of milliseconds."""
LARGEST_RANGE = 2**22
"""Wider ranges are sampled from this many of their least values."""


@dataclass(slots=True)
class PostDuringCall:
    """An event that the host posts during one of the next calls of operations."""

    calls: int = 0
    """Calls up to and including that one; 0: nothing is posted."""
    occurrence: Occurrence = NOTHING

    def count_call(self) -> bool:
        """Count a call; return whether this call posts the event."""
        if self.calls == 0:
            return False
        self.calls -= 1
        return self.calls == 0


class SeededHost:
    """Operations that return pseudo-random values: a linear congruential generator mod 2^31."""

    def __init__(self, chart: Chart, seed: int = 1) -> None:
        self.state = seed
        self.within = PostDuringCall()
        """The event that an operation posts."""
        self.given: Mapping[str, tuple[lang.Value, ...]] = {}
        """Results of operations, one per call; the last one repeats. Never modified in place."""
        self._chart = chart
        self._post: Post | None = None
        self._operations = every_operation(chart)

    def call(self, operation: str, arguments: tuple[lang.Value, ...]) -> lang.Value | None:
        """Return the next result of an operation."""
        del arguments
        if self.within.count_call() and self._post is not None:
            self._post(self.within.occurrence)
        return self.result(operation)

    def result(self, operation: str) -> lang.Value | None:
        """Return the next result: a given one, one of the ``from`` list, or any of its type."""
        declared = self._operations[operation]
        given = self.given.get(operation, ())
        if declared.result is None:
            return None
        if given:
            if len(given) > 1:
                self.given = {**self.given, operation: given[1:]}
            return given[0]
        if declared.tried:
            return declared.tried[(self._next() >> 8) % len(declared.tried)]
        return self.value(declared.result)

    def _next(self) -> int:
        self.state = (1103515245 * self.state + 12345) % 2**31
        return self.state

    def accept_posts(self, chart: Chart, post: Post) -> None:
        """Store the function that posts to the machine; invoked machines have their own."""
        if chart is self._chart:
            self._post = post

    def delay(self, least: int, greatest: int) -> int:
        """Return a pseudo-random delay within the interval of an environment chart."""
        return least + (self._next() >> 8) % (greatest - least + 1)

    def value(self, type_: lang.Type) -> lang.Value:
        """Return the next value of a type."""
        if isinstance(type_, lang.ArrayType | lang.RecordType):
            return tuple(self.value(part) for part in part_types(type_))
        x = self._next()
        match type_:
            case lang.BoolType():
                return bool(x >> 16 & 1)
            case lang.IntType(lo, hi):
                return lo + (x >> 8) % min(hi - lo + 1, LARGEST_RANGE)
            case lang.EnumType(numbers=numbers):
                return numbers[(x >> 8) % len(numbers)]
            case lang.DurationType():
                return (x >> 8) % 1001
            case lang.FloatType():
                return ((x >> 8) % 2001 - 1000) / 8
            case lang.SymbolType():
                return ""
            case _:
                assert_never(type_)


def run_script(chart: Chart, lines: Sequence[str]) -> list[str]:
    """Run the interpreter by a script and return the trace; `FsmkitError` for a wrong line."""
    player = Player(chart)
    return [told for line in script_texts(lines) for told in player.trace(line)]


def script_texts(lines: Sequence[str], name: str = "<script>") -> Iterator[Text]:
    """Yield lines with their places, for diagnostics."""
    source = Source(name, "".join(f"{line}\n" for line in lines))
    offset = 0
    for line in lines:
        yield Text(line, Span(source, offset, offset + len(line)))
        offset += len(line) + 1


class Player:
    """A machine under a script."""

    def __init__(self, chart: Chart, host: SeededHost | None = None) -> None:
        self.chart = chart
        self.host = SeededHost(chart) if host is None else host
        self.snapshot = interpreter.initial(chart)
        self._saved = b""
        self.now = 0
        """Ticks; not wrapped: the interpreter compares times as numbers."""

    def trace(self, line: Text) -> Iterator[str]:
        """Execute a line and yield its trace."""
        for told in self.play(line):
            if isinstance(told, str):
                yield told
            else:
                yield from trace_lines(self.chart, (told,))

    def play(self, line: Text) -> tuple[Macrostep | str, ...]:
        """Execute a line; return its macrosteps, and trace lines that belong to no macrostep."""
        read = read_line(self.chart, line)
        match read.verb:
            case "start":
                self.now = read.number
                inputs = self.snapshot.inputs
                return self._done(interpreter.start(self.chart, self.now, self.host, inputs))
            case "run":
                self._pass_time(read.number)
                done = interpreter.run(self.chart, self.snapshot, self.now, self.host)
                return self._done(*done)
            case "at":
                self._pass_time(read.number)
            case "post":
                posted = interpreter.post(self.chart, self.snapshot, read.event)
                self.snapshot = posted or self.snapshot
                return () if posted else ("full queue",)
            case "dispatch" | "ask":
                return self._dispatch(read.event, is_asking=read.verb == "ask")
            case "input":
                place, inputs = read.number, self.snapshot.inputs
                inputs = (*inputs[:place], read.value, *inputs[place + 1 :])
                self.snapshot = replace(self.snapshot, inputs=inputs)
            case "within":
                self.host.within = PostDuringCall(read.number, read.event)
            case "returns":
                self.host.given = {**self.host.given, read.name: read.results}
            case "seed":
                self.host.state = read.number
            case "dump":
                return tuple(dump_lines(self.chart, self.snapshot))
            case "save":
                self._saved = snapshot_bytes.pack(self.chart, self.snapshot)
                return (f"saved {self._saved.hex()}",)
            case _:  # restore
                self.now = read.number
                self._saved = read.data or self._saved
                try:
                    self.snapshot = snapshot_bytes.unpack(self.chart, self._saved, self.now)
                except FsmkitError:
                    self.snapshot = interpreter.initial(self.chart)
                    return ("not restored",)
        return ()

    def _dispatch(self, event: Occurrence, *, is_asking: bool) -> tuple[Macrostep | str, ...]:
        """Dispatch an event; ``ask`` returns how it was handled, and the value of a reply or 0."""
        if not self.snapshot.running:
            return ("answer stopped",) if is_asking else ()
        one, is_handled, reply = interpreter.dispatch(
            self.chart, self.snapshot, event, self.now, self.host
        )
        answer = ["answer", "handled" if is_handled else "ignored"]
        type_ = self.chart.events[event.event].reply
        if type_ is not None:
            nothing = "" if isinstance(type_, lang.SymbolType) else 0
            answer.append(value_text(nothing if reply is None else reply))
        return (*self._done(one), *([" ".join(answer)] if is_asking else []))

    def _done(self, *macrosteps: Macrostep) -> tuple[Macrostep, ...]:
        if macrosteps:
            self.snapshot = macrosteps[-1].after
        self.snapshot = interpreter.at_time(self.snapshot, self.now)
        return macrosteps

    def _pass_time(self, now: int) -> None:
        """Take the reading of a 32-bit clock that may have wrapped around since the last one."""
        passed = (now - self.now) % CLOCK
        self.now += passed if passed < CLOCK // 2 else passed - CLOCK


KNOWN = (
    "use `start`, `run`, `at`, `post`, `dispatch`, `ask`, `within`, `returns`, `input`, `seed`, "
    "`dump`, `save` or `restore`"
)


@dataclass(frozen=True, slots=True)
class Line:
    """A parsed script line: the arguments of its verb."""

    verb: str
    number: int = 0
    """A time, a seed, the place of an input, or a number of calls."""
    event: Occurrence = NOTHING
    value: lang.Value = 0
    data: bytes = b""
    name: str = ""
    """Results of the operation."""
    results: tuple[lang.Value, ...] = ()


def read_line(chart: Chart, line: Text) -> Line:
    """Parse a script line; raises `FsmkitError` (``wrong-script-line``) if it is invalid."""
    words = iter(tokens(line.value))
    match verb := next(words, ""):
        case "start" | "run" | "at" | "seed":
            read = Line(verb, _number(words, line))
        case "restore":
            read = Line(verb, _number(words, line), data=_bytes(words, line))
        case "post" | "dispatch" | "ask":
            read = Line(verb, event=read_event(chart, words, line))
        case "within":
            number = _number(words, line)
            read = Line(verb, number, event=read_event(chart, words, line))
        case "input":
            place, value = read_input(chart, words, line)
            read = Line(verb, place, value=value)
        case "returns":
            name, results = read_results(chart, words, line)
            read = Line(verb, name=name, results=results)
        case "dump" | "save":
            read = Line(verb)
        case _:
            raise wrong_line(line, f"`{verb}` is not a script line", KNOWN)
    if next(words, None) is not None:
        raise wrong_line(line, "there are words left at the end of the line", KNOWN)
    return read


def _number(words: Iterator[str], line: Text) -> int:
    word = next(words, "")
    if not word.isdecimal():
        raise wrong_line(line, f"`{word}` is not a number", KNOWN)
    return int(word)


def _bytes(words: Iterator[str], line: Text) -> bytes:
    """Read bytes in hexadecimal; none where the line ends."""
    word = next(words, "")
    try:
        return bytes.fromhex(word)
    except ValueError as error:
        raise wrong_line(
            line, f"`{word}` is not a sequence of bytes in hexadecimal", KNOWN
        ) from error


def read_event(chart: Chart, words: Iterator[str], line: Text) -> Occurrence:
    """Read an event and a value for each of its fields, by position or as ``name=value``."""
    name = next(words, "")
    index = chart.event_index.get(name)
    if index is None:
        known = [event.name for event in chart.events if is_received(event)]
        raise unknown_name(line, "event", name, known)
    fields = chart.events[index].fields
    rest = _sort_arguments(list(words), [field.name for field in fields])
    payload: list[lang.Value] = []
    for field in fields:
        try:
            payload.append(read_value(rest, field.type, chart.capacities.tick))
        except ValueError as error:
            advice = (
                f"write `{name} {' '.join(f'{f.name}={_example_value(f.type)}' for f in fields)}`"
            )
            raise wrong_line(line, f"`{field.name}` of `{name}` {error}", advice) from error
    left = next(rest, None)
    if left is not None:
        taken = ", ".join(f"`{field.name}`" for field in fields) or "nothing"
        raise wrong_line(line, f"the event `{name}` does not take `{left}`", f"it takes {taken}")
    return Occurrence(index, tuple(payload))


def is_received(event: Event) -> bool:
    """Return whether a host may post an event: neither a platform event nor an output."""
    return bool(event.directions) and event.directions != {Direction.OUT}


def read_input(chart: Chart, words: Iterator[str], line: Text) -> tuple[int, lang.Value]:
    """Read the name of an input and a value; return its place in the snapshot and the value."""
    name = next(words, "")
    names = [variable.name for variable in chart.inputs]
    if name not in names:
        raise unknown_name(line, "input", name, names)
    place = names.index(name)
    try:
        return place, read_value(words, chart.inputs[place].type, chart.capacities.tick)
    except ValueError as error:
        advice = f"write `set {name} {_example_value(chart.inputs[place].type)}`"
        raise wrong_line(line, f"`{name}` {error}", advice) from error


def read_results(
    chart: Chart, words: Iterator[str], line: Text
) -> tuple[str, tuple[lang.Value, ...]]:
    """Read the name of an operation and the results that it returns, to the end of the line."""
    name = next(words, "")
    types = result_types(chart)
    type_ = types.get(name)
    if type_ is None and name in every_operation(chart):
        raise wrong_line(line, f"the operation `{name}` returns nothing")
    if type_ is None:
        raise unknown_name(line, "operation with a result", name, list(types))
    results: list[lang.Value] = []
    first = next(words, None)
    while first is not None or not results:
        head = () if first is None else (first,)
        try:
            results.append(read_value(chain(head, words), type_, chart.capacities.tick))
        except ValueError as error:
            advice = f"write `{name} returns {_example_value(type_)}`"
            raise wrong_line(line, f"the result of `{name}` {error}", advice) from error
        first = next(words, None)
    return name, tuple(results)


def is_returns(words: Sequence[str]) -> bool:
    """Whether words give the results of an operation: ``OPERATION returns V1, V2``."""
    return len(words) > 1 and words[1] == "returns"


def _example_value(type_: lang.Type) -> str:
    """Return an example of a value of type `type_`, for help."""
    value = lang.default_value(type_)
    return "..." if isinstance(value, tuple) else lang.format_value(value, type_)


def _sort_arguments(words: list[str], names: list[str]) -> Iterator[str]:
    """Return the words in the order of `names`, if they have the form ``name=value``."""
    given: dict[str, list[str]] = {}
    current = ""
    for word in words:
        name, equals, value = word.partition("=")
        if equals and name in names and name not in given:
            current, word = name, value  # noqa: PLW2901  (the value after the name)
        given.setdefault(current, []).extend([word] if word else [])
    if not any(name in given for name in names):
        return iter(words)
    return iter([*(w for name in names for w in given.get(name, ())), *given.get("", ())])


def read_wait(text: str, line: Text, tick: int) -> int:
    """Return the ticks of a time to wait, such as ``500ms``; `FsmkitError` for one without end."""
    try:
        ticks = read_microseconds(text) // tick
    except ValueError as error:
        raise wrong_line(line, f"the time to wait {error}", "write `wait 500ms`") from error
    if ticks > LONGEST_WAIT:
        longest = duration_text(LONGEST_WAIT * tick)
        raise wrong_line(line, "the time to wait is too long", f"wait for {longest} at most")
    return ticks


def unknown_name(line: Text, kind: str, name: str, known: Sequence[str]) -> FsmkitError:
    """Return the error for a name that the chart does not have."""
    return wrong_line(line, f"there is no {kind} `{name}`", help_for(kind, name, known))


def help_for(kind: str, name: str, known: Sequence[str]) -> str | None:
    """Return the help for an unknown name, or None.

    An event may extend a prefix of tokens that the chart matches.
    """
    tokens = name.split(".")
    above = [".".join(tokens[:length]) for length in range(len(tokens) - 1, 0, -1)]
    prefix = next((each for each in above if each in known), None)
    if kind != "event" or prefix is None:
        return suggest(name, known, f"there are: {', '.join(known) or 'none'}")
    return (
        f"post `{prefix}`, or declare the event in the chart: "
        f'`<fk:event direction="in" signature="{name}"/>`, in YAML under `events: in:`'
    )


def wrong_line(line: Text, message: str, help_: str | None = None) -> FsmkitError:
    """Return the error for a line that cannot be done."""
    return fail("wrong-script-line", message, line, help=help_)
