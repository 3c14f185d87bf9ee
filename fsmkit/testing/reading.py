"""Reads ``*.test.yaml``: the words of `fsmkit run`, and expectations."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

from fsmkit.chart.chart import Chart, every_operation
from fsmkit.chart.loading import read_bytes
from fsmkit.diagnostics import Findings, FsmkitError, Text
from fsmkit.diagnostics.split_text import split_outside
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.document.document import Direction
from fsmkit.language import BOOL, Field, Literal, Scope, Type, Value, fold, type_expression
from fsmkit.language.values import read_value, tokens
from fsmkit.runtime.script import is_received, read_event, read_input, read_wait, wrong_line
from fsmkit.system.any_file import read, system_within
from fsmkit.system.system import System
from fsmkit.testing.suite import (
    Case,
    Expect,
    InState,
    Pattern,
    Post,
    Returns,
    SetInput,
    Start,
    Step,
    Suite,
    That,
    Wait,
)
from fsmkit.verify import questions
from fsmkit.yaml import nodes
from fsmkit.yaml.encoding import decode
from fsmkit.yaml.fields import names
from fsmkit.yaml.nodes import (
    Sequence as Items,
)

SUFFIXES = (".test.yaml", ".test.yml")
KEYS = ("tests", "req", "chart", "system", "before", "cases")
CASE = ("req", "steps")
"""The keys of a case that is no plain list of steps."""
EXPECTATIONS = (
    "in", "not in", "called", "not called", "sent", "not sent", "fault", "that", "only",
)  # fmt: skip
STEPS = ("start", "post", "set", "wait")
RETURNS = re.compile(r"(?P<call>.*\S)\s+returns\s+(?P<values>\S.*)", re.DOTALL)
CALL = re.compile(r"(?P<name>[^\s()]+)\s*(?:\((?P<arguments>.*)\))?", re.DOTALL)
NAMED = re.compile(r"(?P<name>\w+)\s*=(?!=)\s*(?P<value>.*)", re.DOTALL)
ANY = "_"
"""An argument that may be anything."""
WORDS = (
    "write `post EVENT`, `set INPUT VALUE`, `wait 500ms`, `OPERATION returns VALUE` or `expect:`"
)


def is_suite(path: Path) -> bool:
    """Whether a file is one of tests, by its name."""
    return path.name.endswith(SUFFIXES)


def read_suite(path: Path, findings: Findings, *, strict: bool = False) -> Suite:
    """Return the tests of a file; raises `FsmkitError` with every finding if it has an error.

    Args:
        path: A file with the keys ``tests``, ``chart`` or ``system``, ``before`` and ``cases``.
        findings: Collects the warnings, including those of the chart.
        strict: As for `fsmkit.read`, for the chart.

    """
    source = decode(read_bytes(path), str(path), findings)
    findings.stop_on_errors()
    root = None if source is None else nodes.read_nodes(source, findings)
    parts = nodes.require_record(root, KEYS, "a file of tests", findings)
    findings.stop_on_errors()
    if root is None or parts is None:
        raise FsmkitError(findings)
    if "tests" not in parts or ("chart" in parts) == ("system" in parts):
        findings.add(
            "broken-tests", "this is not a test file", root.span,
            help="name the tests and their subject: `tests: Gate`, and `chart: gate.yaml` "
            "or `system: cell.yaml`",
        )  # fmt: skip
        raise FsmkitError(findings)
    name = nodes.require_text(parts["tests"], "the name of the tests", findings)
    model = nodes.require_text(
        parts.get("chart") or parts["system"], "the path of the model", findings
    )
    findings.stop_on_errors()
    if name is None or model is None:
        raise FsmkitError(findings)
    about = path.parent / model.value
    system = system_within(read(about, findings, strict=strict))
    cases = _Reader(system, findings).cases(parts)
    findings.stop_on_errors()
    return Suite(name.value, path, about, system, cases)


@dataclass(slots=True)
class _Reader:
    system: System
    findings: Findings

    @property
    def is_alone(self) -> bool:
        """Return whether names have no machine prefix."""
        return self.system.is_open and len(self.system.machines) == 1

    def cases(self, parts: dict[str, nodes.Node]) -> tuple[Case, ...]:
        """Read the cases, each with the steps of ``before``.

        The machines start after the leading inputs and results of ``before``, or at the word
        ``start``.
        """
        before = tuple(self._steps(parts.get("before"), "`before`"))
        if not any(isinstance(step, Start) for step in before):
            first = [*takewhile(lambda step: isinstance(step, SetInput | Returns), before)]
            before = (*first, Start(_nowhere(parts)), *before[len(first) :])
        cases = []
        shared = names(parts.get("req"), "`req`", self.findings)
        for name, given in nodes.entries_of(parts.get("cases"), "`cases`", self.findings):
            errors = len(self.findings)
            node: nodes.Node | None = given
            own: tuple[Text, ...] = ()
            if isinstance(given, nodes.Mapping):
                inner = nodes.require_record(given, CASE, f"the case `{name}`", self.findings) or {}
                node, own = inner.get("steps"), names(inner.get("req"), "`req`", self.findings)
            steps = tuple(self._steps(node, f"the case `{name}`"))
            is_read = len(self.findings) == errors
            if any(isinstance(step, Start) for step in steps):
                self._wrong(name, f"the case `{name}` starts again", "write `start` under `before`")
            if is_read and not any(isinstance(step, Expect) for step in steps):
                self._wrong(
                    name, f"the case `{name}` expects nothing",
                    "add a step `expect: {in: STATE}`",
                )  # fmt: skip
            cases.append(Case(name, (*before, *steps), tuple(dict.fromkeys((*shared, *own)))))
        if not cases and not self.findings.has_errors:
            self._wrong(_nowhere(parts), "there are no cases", "name them under `cases`")
        return tuple(cases)

    def _wrong(self, at: Text, message: str, help_: str) -> None:
        self.findings.add("broken-tests", message, at, help=help_)

    def _steps(self, node: nodes.Node | None, what: str) -> Iterator[Step]:
        for item in nodes.items_of(node, what, self.findings):
            if isinstance(item, nodes.Scalar):
                for text in split(item.text, ";"):
                    try:
                        yield self._step(text)
                    except FsmkitError as error:
                        self.findings.extend(error.diagnostics)
                continue
            if isinstance(item, nodes.Mapping) and item.entries[0][0].value in STEPS:
                text = item.entries[0][0]
                self._wrong(text, "a step is a text", f"write `- {text} ...`, without a colon")
                continue
            parts = nodes.require_record(item, ("expect",), "a step", self.findings)
            if parts and "expect" in parts:
                record = nodes.require_record(
                    parts["expect"], EXPECTATIONS, "an expectation", self.findings
                )
                if record is not None:
                    try:
                        yield self._expect(item, record)
                    except FsmkitError as error:
                        self.findings.extend(error.diagnostics)

    # --- steps -----------------------------------------------------------------------------------

    def _step(self, text: Text) -> Step:
        returns = RETURNS.fullmatch(text.value)
        if returns is not None and not text.value.startswith(("post ", "set ")):
            return self._returns(text, text.part(*returns.span("call")), returns)
        word, _, rest = text.value.partition(" ")
        after = text.part(len(text.value) - len(rest), len(text.value)).strip()
        match word:
            case "start" if not rest and not self._has_event("start"):
                return Start(text)
            case "wait":
                return Wait(text, self._ticks(after))
            case "set":
                machine, chart, line = self._of_machine(after)
                words = iter(tokens(line.value))
                place, value = read_input(chart, words, line)
                _require_end(words, text)
                return SetInput(text, machine, place, value)
            case _:
                return self._post(text, after if word == "post" else text)

    def _post(self, text: Text, event: Text) -> Post:
        machine, chart, line = self._of_machine(event)
        words = iter(tokens(line.value))
        known = [event.name for event in chart.events if is_received(event)]
        name = line.value.split(" ", 1)[0]
        if name not in known:
            raise wrong_line(
                text, f"there is no event `{name}`", suggest(name, known, WORDS) or WORDS
            )
        occurrence = read_event(chart, words, line)
        _require_end(words, text)
        return Post(text, machine, occurrence)

    def _has_event(self, name: str) -> bool:
        return self.is_alone and name in self.system.machines[0].chart.event_index

    def _ticks(self, text: Text) -> int:
        return read_wait(text.value, text, self.system.machines[0].chart.capacities.tick)

    def _returns(self, text: Text, call: Text, match: re.Match[str]) -> Returns:
        pattern, type_ = self._call(call)
        if type_ is None:
            raise wrong_line(text, f"the operation `{pattern.name}` returns nothing", "remove it")
        chart = self.system.machines[pattern.machine].chart
        values = [
            self._value(one, type_, chart, f"the result of `{pattern.name}`")
            for one in split(text.part(*match.span("values")), ",")
        ]
        return Returns(text, pattern, tuple(values))

    def _of_machine(self, text: Text) -> tuple[int, Chart, Text]:
        """Return the machine of a dotted name, its chart, and the rest of the name."""
        if self.is_alone:
            return 0, self.system.machines[0].chart, text
        machine, dot, _ = text.value.split(" ", 1)[0].split("(", 1)[0].partition(".")
        names = [each.name for each in self.system.machines]
        if not dot or machine not in names:
            help_ = suggest(machine, names, f"write `machine.name`; there are {', '.join(names)}")
            raise wrong_line(text, f"there is no machine `{machine}`", help_)
        place = names.index(machine)
        rest = text.part(len(machine) + 1, len(text.value))
        return place, self.system.machines[place].chart, rest

    # --- expectations ----------------------------------------------------------------------------

    def _expect(self, node: nodes.Node, parts: dict[str, nodes.Node]) -> Expect:
        if not parts:
            raise wrong_line(_text_at(node), "it expects nothing", "write for instance `in: STATE`")
        fault = nodes.require_text(parts.get("fault"), "`fault`", self.findings)
        if fault is not None and fault.value == "none":
            fault = fault.with_value("")
        return Expect(
            node.span,
            tuple(map(self._state, self._texts(parts, "in"))),
            tuple(map(self._state, self._texts(parts, "not in"))),
            self._patterns(parts, "called") if "called" in parts else None,
            self._patterns(parts, "not called") or (),
            self._patterns(parts, "sent") if "sent" in parts else None,
            self._patterns(parts, "not sent") or (),
            fault,
            tuple(map(self._that, self._texts(parts, "that"))),
            self._flag(parts.get("only")),
        )

    def _texts(self, parts: dict[str, nodes.Node], key: str) -> Iterator[Text]:
        """Yield the texts under a key: one, or a list of them."""
        node = parts.get(key)
        for item in node.items if isinstance(node, Items) else [node]:
            text = nodes.require_text(item, f"`{key}`", self.findings)
            if text is not None:
                yield text

    def _flag(self, node: nodes.Node | None) -> bool:
        text = nodes.require_text(node, "`only`", self.findings)
        if text is not None and text.value not in ("true", "false"):
            raise wrong_line(text, f"`{text}` is neither `true` nor `false`", "write `only: true`")
        return text is not None and text.value == "true"

    def _state(self, text: Text) -> InState:
        machine, chart, name = self._of_machine(text)
        if name.value not in chart.active_index:
            known = list(chart.active_index)
            some = f"there are {', '.join(known[1:9])}"
            raise wrong_line(text, f"there is no state `{name}`", suggest(name.value, known, some))
        return InState(text, machine, chart.active_index[name.value])

    def _patterns(self, parts: dict[str, nodes.Node], key: str) -> tuple[Pattern, ...]:
        of = self._call if key.endswith("called") else self._sent
        return tuple(of(text)[0] for text in self._texts(parts, key))

    def _call(self, text: Text) -> tuple[Pattern, Type | None]:
        """Read a call of an operation; return it and the type of its result."""
        machine, chart, line = self._of_machine(text)
        operations = every_operation(chart)
        name, arguments = _name_and_arguments(line)
        if name.value not in operations:
            known = list(operations)
            some = f"there are {', '.join(known[:8])}" if known else "the chart has none"
            raise wrong_line(
                text, f"there is no operation `{name}`", suggest(name.value, known, some)
            )
        declared = operations[name.value]
        values = self._arguments(arguments, declared.parameters, chart, name.value)
        return Pattern(text, machine, name.value, values), declared.result

    def _sent(self, text: Text) -> tuple[Pattern, None]:
        machine, chart, line = self._of_machine(text)
        name, arguments = _name_and_arguments(line)
        events = {e.name: e for e in chart.events if Direction.OUT in e.directions}
        if name.value not in events:
            known = list(events)
            some = f"there are {', '.join(known[:8])}" if known else "the chart sends none"
            raise wrong_line(
                text, f"the chart sends no event `{name}`", suggest(name.value, known, some)
            )
        fields = events[name.value].fields
        return Pattern(
            text, machine, name.value, self._arguments(arguments, fields, chart, name.value)
        ), None

    def _arguments(
        self, text: Text | None, fields: Sequence[Field], chart: Chart, name: str
    ) -> tuple[tuple[int, Value], ...]:
        """Read values by position or as ``name = value``; `_` matches any value."""
        found: dict[int, Value] = {}
        names = [field.name for field in fields]
        if text is None:
            return ()
        for place, one in enumerate(split(text, ",")):
            named = NAMED.fullmatch(one.value)
            value = one
            if named is not None and named["name"] in names:
                place, value = names.index(named["name"]), one.part(*named.span("value"))  # noqa: PLW2901
            if place >= len(fields) or place in found:
                raise wrong_line(
                    one, f"`{name}` takes {', '.join(f'`{n}`' for n in names) or 'no values'}",
                    "give each once",
                )  # fmt: skip
            if value.value != ANY:
                what = f"`{names[place]}` of `{name}`"
                found[place] = self._value(value, fields[place].type, chart, what)
        return tuple(sorted(found.items()))

    def _value(self, text: Text, type_: Type, chart: Chart, what: str) -> Value:
        """Read a value as scripts have it, or an expression of constants of the chart."""
        words = iter(tokens(text.value))
        try:
            value = read_value(words, type_, chart.capacities.tick)
            _require_end(words, text)
        except (ValueError, FsmkitError) as error:
            scope = Scope(
                constants=dict(chart.constants),
                types={str(t): t for t in chart.types},
                tick=chart.capacities.tick,
            )
            tree = type_expression(text, scope, Findings(), type_)
            known = None if tree is None else fold(tree)
            if isinstance(known, Literal):
                return known.value
            reason = str(error) if isinstance(error, ValueError) else "has words left"
            raise wrong_line(text, f"{what} {reason}", f"write a value of `{type_}`") from error
        return value

    def _that(self, text: Text) -> That:
        machine = 0 if self.is_alone else None
        return That(text, questions.read(self.system, text, machine, BOOL))


def _name_and_arguments(text: Text) -> tuple[Text, Text | None]:
    match = CALL.fullmatch(text.value)
    if match is None:
        raise wrong_line(text, f"`{text}` is not a call", "write `name` or `name(value, ...)`")
    arguments = None if match["arguments"] is None else text.part(*match.span("arguments"))
    return text.part(*match.span("name")), arguments


def _require_end(words: Iterator[str], line: Text) -> None:
    if next(words, None) is not None:
        raise wrong_line(line, "there are words left at the end of the step", WORDS)


def split(text: Text, separator: str) -> Iterator[Text]:
    """Yield the nonempty parts between separators outside quotes and brackets."""
    for part in split_outside(text, separator):
        if part.value.strip():
            yield part.strip()


def _text_at(node: nodes.Node) -> Text:
    return Text(node.span.source.text[node.span.start : node.span.end], node.span)


def _nowhere(parts: dict[str, nodes.Node]) -> Text:
    """Return the location of the whole file, for items without a location."""
    node = parts["tests"]
    return node.text if isinstance(node, nodes.Scalar) else Text("", node.span)
