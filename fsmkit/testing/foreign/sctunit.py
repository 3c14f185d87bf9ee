"""Runs SCTUnit tests of itemis CREATE on an imported statechart.

A test enters the machine, raises events, lets cycles or time pass, and asserts states, variables,
events and calls. The interpreter runs it; generated C and Python do the same steps and must have
the same trace. A variable that the test writes gets an event that sets it; one that the statechart
does not use belongs to the test.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import zip_longest
from operator import add, and_, eq, ge, gt, le, lt, mul, ne, or_, sub, xor
from pathlib import Path
from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import elaborated, read_bytes
from fsmkit.diagnostics import Findings, FsmkitError, Span, Text
from fsmkit.document.document import (
    Direction,
    DocEvent,
    DocState,
    DocTransition,
    Document,
    Trigger,
)
from fsmkit.foreign.itemis.reader import Names, decode, import_named, machines
from fsmkit.foreign.itemis.text import DEEPEST, LEVELS, Parser, Scope, Symbol, SyntaxFault
from fsmkit.language import Type, default_value
from fsmkit.language.statements.reading import read_statements
from fsmkit.language.statements.tree import DocField
from fsmkit.language.values import to_python
from fsmkit.runtime.interpreter.snapshot import Emitted, Macrostep, Occurrence, Timeout
from fsmkit.runtime.interpreter.trace import dump_lines, trace_lines, value_text
from fsmkit.runtime.session import Session, occurrence_of
from fsmkit.testing.conformance.conformance import Case, Result, Verdict
from fsmkit.testing.harness.harness import Harness
from fsmkit.testing.running import Runtime
from fsmkit.testing.runtimes import TARGETS, runtime

PERIOD = 200
"""Milliseconds of a cycle without an annotation."""
NAMED = re.compile(rb"<sgraph:Statechart\b[^>]*?\sname=\"(\w+)\"")
LARGEST_HEAD = 1 << 20
"""Bytes of a statechart's file in which its name is searched."""
MOST_CYCLES = 5_000
"""Cycles of one test."""
OPERATORS: dict[str, Callable[[Any, Any], Any]] = {
    "+": add, "-": sub, "*": mul, "==": eq, "!=": ne, "<": lt, "<=": le, ">": gt, ">=": ge,
    "&": and_, "|": or_, "^": xor, "%": lambda a, b: a - b * int(a / b),
    "/": lambda a, b: a / b if isinstance(a, float) or isinstance(b, float) else int(a / b),
}  # fmt: skip
MILLISECONDS = {"s": 1000.0, "ms": 1.0, "us": 0.001, "ns": 0.000001}


class NotRun(Exception):  # noqa: N818
    """The test, or its statechart, has a construct that is not run; the message names it."""


class Failed(Exception):  # noqa: N818
    """An assertion failed, or a runtime did something else."""


@dataclass(frozen=True, slots=True)
class Operation:
    """An operation of a test class: a test, or a helper."""

    name: str
    parameters: tuple[str, ...]
    body: tuple[Any, ...]
    is_test: bool


@dataclass(frozen=True, slots=True)
class TestClass:
    """The tests of one file. Statements and expressions are tuples that start with their kind."""

    __test__ = False
    name: str
    statechart: str
    operations: Mapping[str, Operation]

    @property
    def tests(self) -> tuple[str, ...]:
        """Return the names of the tests, in order."""
        return tuple(one.name for one in self.operations.values() if one.is_test)


@dataclass(frozen=True, slots=True)
class TestResult:
    """The result of a test; a skipped one has a construct that is not read, or not run."""

    __test__ = False
    test: str
    result: Result
    reason: str = ""


# --- reading --------------------------------------------------------------------------------------


class _Reader(Parser):
    """Reads a file of tests."""

    def test_class(self) -> TestClass | None:
        """Return the test class; None for a suite, which lists test classes only."""
        if self.take("package"):
            self.path()
        if self.take("testsuite"):
            return None
        self.need("testclass")
        name = self.name()
        self.need("for")
        self.need("statechart")
        statechart = self.path()
        self.need("{")
        operations: dict[str, Operation] = {}
        while not self.take("}"):
            is_test = False
            while self.take("@"):
                is_test = self.name() == "Test" or is_test
            self.need("operation")
            own = self.name()
            parameters = []
            self.need("(")
            while not self.take(")"):
                parameters.append(self.name())
                self.need(":")
                self.path()
                self.take(",")
            if self.take(":"):
                self.path()
            operations[own] = Operation(own, tuple(parameters), self.block(), is_test)
        return TestClass(name, statechart.rpartition(".")[2], operations)

    def block(self) -> tuple[Any, ...]:
        """Return the statements within braces."""
        self.need("{")
        self.depth += 1
        if self.depth > DEEPEST:
            raise SyntaxFault("the test is too deeply nested", self.at)
        found = []
        while not self.take("}"):
            found.append(self.statement())
            self.take(";")
        self.depth -= 1
        return tuple(found)

    def statement(self) -> tuple[Any, ...]:
        """Return a statement."""
        word = self.take("enter", "exit", "raise", "proceed", "assert", "var", "while", "if",
                         "mock", "return")  # fmt: skip
        match word:
            case "enter" | "exit":
                return (word,)
            case "raise":
                event = self.path()
                return ("raise", event, self.value() if self.take(":") else None)
            case "proceed":
                count = self.value()
                unit = self.name()
                if unit not in ("cycle", "cycles", *MILLISECONDS):
                    raise SyntaxFault(f"`{unit}` is no unit of time", self.at)
                return ("proceed", count, unit)
            case "assert":
                test = self.value()
                message = self.value() if self.take("message") else ("value", "")
                return ("assert", test, message, self.line())
            case "var":
                name = self.name()
                self.need(":")
                self.path()
                return ("var", name, self.value() if self.take("=") else ("value", 0))
            case "while":
                return ("while", self.value(), self.block())
            case "if":
                test, yes = self.value(), self.block()
                return ("if", test, yes, self.block() if self.take("else") else ())
            case "mock":
                name, given = self.path(), self.arguments()
                self.need("returns")
                self.need("(")
                value = self.value()
                self.need(")")
                return ("mock", name, given, value)
            case "return":
                return ("return", self.value())
        target = self.value()
        operator = self.take("=", "+=", "-=", "*=", "++", "--")
        if operator is None:
            return ("do", target)
        if target[0] != "name":
            raise SyntaxFault("only variables can be assigned", self.at)
        value = ("value", 1) if operator in ("++", "--") else self.value()
        if operator != "=":
            value = ("binary", operator[0], target, value)
        return ("set", target[1], value)

    def line(self) -> int:
        """Return the number of the line of the previous token."""
        return self.text.value.count("\n", 0, self.found[self.at - 1].start) + 1

    def arguments(self) -> tuple[Any, ...] | None:
        """Return arguments in brackets, or None."""
        if not self.take("("):
            return None
        found = []
        while not self.take(")"):
            found.append(self.value())
            self.take(",")
        return tuple(found)

    def value(self, level: int = -3) -> tuple[Any, ...]:
        """Return an expression: the levels below 0 are `? :`, `||` and `&&`."""
        if level == -3:
            self.depth += 1
            if self.depth > DEEPEST:
                raise SyntaxFault("the test is too deeply nested", self.at)
            test = self.value(-2)
            self.depth -= 1
            if not self.take("?"):
                return test
            yes = self.value(-2)
            self.need(":")
            return ("choose", test, yes, self.value(-2))
        if level == len(LEVELS):
            return self.operand()
        signs = LEVELS[level] if level >= 0 else ("||",) if level == -2 else ("&&",)
        if level == 0 and self.take("!"):
            return ("not", self.value(0))
        left = self.value(level + 1)
        while sign := self.take(*signs):
            left = ("binary", sign, left, self.value(level + 1))
        return left

    def operand(self) -> tuple[Any, ...]:
        """Return an operand."""
        if self.take("-"):
            return ("binary", "-", ("value", 0), self.operand())
        token = self.token
        self.at += 1
        if token.kind == "number":
            number = token.text.lower().rstrip("df") if "." in token.text else token.text
            return ("value", float(number) if "." in number else int(number, 0))
        if token.kind == "string":
            return ("value", re.sub(r"\\(.)", r"\1", token.text[1:-1]))
        if token.text == "(":
            inner = self.value()
            self.need(")")
            return inner
        if token.kind != "name":
            raise SyntaxFault(f"an expression is missing before `{token.text}`", self.at - 1)
        constants = {"true": True, "yes": True, "false": False, "no": False}
        if token.text in constants:
            return ("value", constants[token.text])
        if token.text in ("active", "valueof") and self.take("("):
            path = self.path()
            self.need(")")
            return (token.text, path)
        if token.text in ("is_final", "is_active"):
            return (token.text,)
        if token.text == "called":
            return ("called", self.path(), self.arguments())
        self.at -= 1
        path = self.path()
        given = self.arguments()
        return ("name", path) if given is None else ("call", path, given)


def read_tests(path: Path) -> TestClass | None:
    """Return the tests of a file; None for a suite. Raises `FsmkitError` for a damaged file."""
    findings = Findings()
    source = decode(read_bytes(path), str(path), findings)
    if source is None:
        raise FsmkitError(findings)
    text = Text(source.text, Span(source, 0, len(source.text)))
    reader = _Reader(text, Scope({}, lambda _: None, lambda *_: (), lambda: ""))
    try:
        return reader.test_class()
    except SyntaxFault as fault:
        token = reader.found[min(fault.at, len(reader.found) - 1)]
        findings.add("foreign-syntax", str(fault), text.part(token.start, token.end),
                     help="check the test in itemis CREATE")  # fmt: skip
    except IndexError:
        findings.add("foreign-syntax", "the test ends too early", text.part(0, 1),
                     help="check the test in itemis CREATE")  # fmt: skip
    raise FsmkitError(findings)


# --- running --------------------------------------------------------------------------------------


class _Return(Exception):  # noqa: N818
    """The value of `return`."""

    def __init__(self, value: object) -> None:
        super().__init__()
        self.value = value


@dataclass
class _Run:
    """One test of a class, on one machine."""

    tests: TestClass
    document: Document
    names: Names
    period: int
    chart_of: Callable[[Document], Chart]
    runtimes: Sequence[Callable[[Chart], Runtime]]
    unused: frozenset[str]
    """Variables that the machine does not use."""
    session: Session | None = None
    started: list[Runtime] = field(default_factory=list)
    starts: dict[str, Any] = field(default_factory=dict)
    """Values of variables before the machine is entered."""
    own: dict[str, Any] = field(default_factory=dict)
    """Variables of the machine that only the test uses."""
    locals: list[dict[str, Any]] = field(default_factory=list)
    mocks: list[tuple[str, tuple[Any, ...] | None, tuple[Any, ...]]] = field(default_factory=list)
    given: dict[str, list[Any]] = field(default_factory=dict)
    calls: list[tuple[str, tuple[Any, ...]]] = field(default_factory=list)
    sent: dict[str, tuple[Any, ...]] = field(default_factory=dict)
    """The events that left in the latest step."""
    time: int = 0
    cycles: int = 0
    is_calling: bool = False

    def __post_init__(self) -> None:
        self.start_values = {d.name.value: "" if d.init is None else d.init.value
                             for d in self.document.data}  # fmt: skip

    def call(self, name: str, values: Sequence[Any]) -> Any:
        """Call an operation of the test class."""
        operation = self.tests.operations[name]
        self.locals.append(dict(zip(operation.parameters, values, strict=False)))
        try:
            self.do_all(operation.body)
        except _Return as returned:
            return returned.value
        finally:
            self.locals.pop()
        return None

    def do_all(self, body: Sequence[Any]) -> None:
        """Do statements."""
        for statement in body:
            self.do(statement)

    def do(self, statement: tuple[Any, ...]) -> None:
        """Do a statement."""
        match statement:
            case ("enter",):
                self.enter()
            case ("exit",):
                self.post("exit", ())
            case ("raise", path, value):
                event = self.symbol(path)
                self.post(event.name, () if value is None else (self.value(value),))
            case ("proceed", count, unit):
                self.proceed(self.value(count), unit)
            case ("assert", test, message, line):
                if not self.value(test):
                    raise Failed(f"line {line}: {self.value(message) or 'the assertion fails'}")
            case ("var", name, value):
                self.locals[-1][name] = self.value(value)
            case ("set", name, value):
                self.set(name, self.value(value))
            case ("while", test, body):
                while self.value(test):
                    self.do_all(body)
            case ("if", test, yes, no):
                self.do_all(yes if self.value(test) else no)
            case ("mock", path, given, value):
                self.mocks.append((self.symbol(path).name, given, value))
            case ("return", value):
                raise _Return(self.value(value))
            case ("do", value):
                named = value[0] == "name" and value[1] in self.tests.operations
                self.value(("call", value[1], ()) if named else value)

    # --- the machine ------------------------------------------------------------------------------

    def symbol(self, path: str) -> Symbol:
        """Return a declaration of the statechart."""
        found = self.names.symbols.get(path)
        if found is None:
            raise NotRun(f"`{path}` is not declared")
        return found

    def entered(self) -> Session:
        """Return the machine, which the test must have entered."""
        if self.session is None:
            raise NotRun("events or time before the machine is entered")
        return self.session

    def enter(self) -> None:
        """Enter the machine, for the first time or again."""
        if self.session is not None:
            self.post("enter", ())
            return
        data = tuple(
            replace(d, init=d.name.with_value(_written(self.starts[d.name.value])))
            if d.name.value in self.starts else d
            for d in self.document.data
        )  # fmt: skip
        chart = self.chart_of(replace(self.document, data=data))
        host = {one.name: self.operation(one.name, one.result) for one in chart.operations}
        self.session = Session(chart, host, start=False)
        self.started = [make(chart) for make in self.runtimes]
        session = self.session
        self.advance(["start 0", "run 0"], lambda: (*session.start(), *session.run(0)))

    def operation(self, name: str, result: Type | None) -> Callable[..., Any]:
        """Return the function of an operation: the last mock that fits, or a default value."""

        def answer(*values: Any) -> Any:
            self.calls.append((name, values))
            value = None if result is None else to_python(default_value(result), result)
            for mocked, given, returned in reversed(self.mocks):
                fits = given is None or tuple(map(self.value, given)) == values or not given
                if mocked == name and fits:
                    was, self.is_calling = self.is_calling, True
                    value, self.is_calling = self.value(returned), was
                    break
            if result is not None:
                self.given.setdefault(name, []).append(value)
            return value

        return answer

    def post(self, event: str, values: tuple[Any, ...]) -> None:
        """Post an event, and run."""
        session = self.entered()
        occurrence = occurrence_of(session.chart, event, values, {})
        session.enqueue(occurrence)
        line = " ".join(("post", event, *map(value_text, occurrence.payload)))
        self.advance([line, f"run {self.time}"], lambda: session.run(self.time))

    def proceed(self, count: Any, unit: str) -> None:
        """Let cycles or time pass."""
        self.entered()
        if unit.startswith("cycle") and self.names.is_event_driven:
            raise NotRun("a cycle of an event-driven statechart")
        is_cycle = unit.startswith("cycle")
        until = self.time + int(count * (self.period if is_cycle else MILLISECONDS[unit]))
        while not self.names.is_event_driven:
            cycle = (self.time // self.period + 1) * self.period
            if cycle > until:
                break
            self.cycles += 1
            if self.cycles > MOST_CYCLES:
                raise NotRun(f"more than {MOST_CYCLES:,} cycles")
            self.run(cycle)
            self.post("cycle", ())
        self.run(until)

    def run(self, until: int) -> None:
        """Run up to a time."""
        session = self.entered()
        self.time = until
        self.advance([f"run {until}"], lambda: session.run(until))

    def advance(self, lines: list[str], run: Callable[[], Sequence[Macrostep]]) -> None:
        """Run, note what left the machine, and compare the other runtimes."""
        session = self.entered()
        chart = session.chart
        self.given.clear()
        done = run()
        inputs = {s.name for s in self.names.symbols.values() if s.kind == "in"}
        for one in done:
            cause = chart.events[one.event.event].name if isinstance(one.event, Occurrence) else ""
            is_step = cause in inputs or isinstance(one.event, Timeout)
            if cause == "cycle" or (self.names.is_event_driven and is_step):
                self.sent.clear()
            for effect in one.effects:
                if isinstance(effect, Emitted):
                    event = chart.events[effect.occurrence.event]
                    self.sent[event.name] = effect.occurrence.payload
        if session.fault:
            raise Failed(f"the machine stops: {session.fault}")
        wanted = [*trace_lines(chart, done), *dump_lines(chart, session.snapshot)]
        for other in self.started:
            found = [text for line in (*lines, "dump") for text in other.do(line, self.given)]
            for left, right in zip_longest(wanted, found, fillvalue="nothing"):
                if left != right:
                    raise Failed(f"{other.name}: `{right}`, interpreter: `{left}`")

    def set(self, name: str, value: Any) -> None:
        """Assign a variable of the test or of the machine."""
        for scope in self.locals[-1:]:
            if name in scope:
                scope[name] = value
                return
        symbol = self.symbol(name)
        if symbol.name in self.unused:
            self.own[symbol.name] = value
        elif self.is_calling:
            raise NotRun(f"an operation writes `{name}`, which the machine uses")
        elif self.session is None:
            self.starts[symbol.name] = value
        else:
            self.post(f"set_{symbol.name}", (value,))

    # --- expressions ------------------------------------------------------------------------------

    def value(self, expression: tuple[Any, ...]) -> Any:
        """Return the value of an expression."""
        match expression:
            case ("value", value):
                return value
            case ("not", value):
                return not self.value(value)
            case ("choose", test, yes, no):
                return self.value(yes if self.value(test) else no)
            case ("binary", "&&", left, right):
                return self.value(left) and self.value(right)
            case ("binary", "||", left, right):
                return self.value(left) or self.value(right)
            case ("binary", operator, left, right):
                return OPERATORS[operator](self.value(left), self.value(right))
            case ("active", path):
                return self.session is not None and self.session.is_in(self.state(path))
            case ("is_active",):
                return self.session is not None and self.session.is_in(self.inner_state())
            case ("is_final",):
                return self.is_final()
            case ("called", path, given):
                name = self.symbol(path).name
                values = None if given is None else tuple(map(self.value, given))
                return any(n == name and values in (None, v) for n, v in self.calls)
            case ("valueof", path):
                payload = self.sent.get(self.symbol(path).name)
                if not payload:
                    raise NotRun(f"the value of `{path}`, which did not leave the machine")
                return payload[0]
            case ("call", name, given) if name in self.tests.operations:
                return self.call(name, [self.value(one) for one in given])
            case ("name", name):
                return self.variable(name)
        raise NotRun(f"the expression `{expression[0]}`")

    def variable(self, name: str) -> Any:
        """Return a variable of the test or of the machine, or whether an event left it."""
        if self.locals and name in self.locals[-1]:
            return self.locals[-1][name]
        symbol = self.symbol(name)
        if symbol.kind in ("in", "local"):
            raise NotRun(f"`{name}` cannot be observed")
        if symbol.kind == "out":
            return symbol.name in self.sent
        if symbol.name in self.own:
            return self.own[symbol.name]
        if self.session is None:
            return self.starts.get(symbol.name, _read(self.start_values.get(symbol.name, "0")))
        constants = {n: value.value for n, value in self.session.chart.constants}
        return constants[symbol.name] if symbol.name in constants else self.session[symbol.name]

    def state(self, path: str) -> str:
        """Return the id of a state."""
        steps = path.split(".")
        for start in range(len(steps)):
            found = self.names.states.get(".".join(steps[start:]))
            if found is not None:
                return found[0]
        raise NotRun(f"there is no state `{path}`")

    def inner_state(self) -> str:
        """Return the id of the state that is active from `enter` to `exit`."""
        return str(self.document.root.children[0].children[0].id)

    def is_final(self) -> bool:
        """Return whether a final state is active in every top-level region."""
        if self.session is None:
            return False
        regions: dict[str, bool] = {}
        for path, (id_, kind) in self.names.states.items():
            region = path.split(".")[0]
            is_there = path.count(".") == 1 and self.session.is_in(id_) and kind == "FinalState"
            regions[region] = regions.get(region, False) or is_there
        return all(regions.values())


def _written(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"' if isinstance(value, str) else str(value)


def _read(text: str) -> Any:
    if text in ("true", "false"):
        return text == "true"
    if text.startswith('"'):
        return re.sub(r"\\(.)", r"\1", text[1:-1])
    return float(text) if "." in text else int(text, 0)


def _with_setters(document: Document, names: Names, written: set[str]) -> Document:
    """Add an event for each variable that a test writes, which sets it."""
    at = document.root.span
    events, moves = [], []
    for symbol in names.symbols.values():
        if symbol.kind != "var" or symbol.name not in written:
            continue
        event = Text(f"set_{symbol.name}", at, ())
        events.append(DocEvent(event, (DocField(Text("value", at, ()), Text(symbol.type, at, ())),),
                               Direction.IN))  # fmt: skip
        block = read_statements(Text(f"{symbol.name} = event.value", at, ()), Findings())
        moves.append(DocTransition(Trigger.EVENT, at, events=(event,), content=block))
    machine: DocState = document.root.children[0]
    machine = replace(machine, transitions=(*machine.transitions, *moves))
    root = replace(document.root, children=(machine,))
    return replace(document, root=root, events=(*document.events, *events))


def _assigned(body: Sequence[Any]) -> set[str]:
    found: set[str] = set()
    for one in body:
        if one[0] == "set":
            found.add(one[1])
        elif one[0] == "while":
            found |= _assigned(one[2])
        elif one[0] == "if":
            found |= _assigned(one[2]) | _assigned(one[3])
    return found


def run_tests(
    path: Path, statechart: Path, runtimes: Sequence[Callable[[Chart], Runtime]] = ()
) -> tuple[TestResult, ...]:
    """Run the tests of a file on a statechart; the interpreter evaluates them.

    Args:
        path: The file of the tests.
        statechart: The file of the statechart.
        runtimes: Other runtimes, whose traces must equal that of the interpreter.

    """
    tests = read_tests(path)
    if tests is None:
        return ()
    findings = Findings()
    try:
        source = decode(read_bytes(statechart), str(statechart), findings)
        name = "" if source is None else next(iter(machines(source, findings)), "")
        found = None if source is None else import_named(source, name, findings)
        findings.stop_on_errors()
        if found is None:
            return tuple(TestResult(test, Result.SKIPPED, "no statechart") for test in tests.tests)
        document, names = found[0].document, found[1]
        assigned = set().union(*(_assigned(one.body) for one in tests.operations.values()))
        unused = _unused(document, names)
        written = {names.symbols[name].name for name in assigned if name in names.symbols} - unused
        document = _with_setters(document, names, written)
        elaborated((document,), Findings())
    except FsmkitError as error:
        reason = f"{error.diagnostics[0].message}"
        return tuple(TestResult(test, Result.SKIPPED, reason) for test in tests.tests)
    charts: dict[str, Chart] = {}

    def chart_of(one: Document) -> Chart:
        key = repr(one.data)
        if key not in charts:
            charts[key] = elaborated((one,), Findings())
        return charts[key]

    def new_run() -> _Run:
        return _Run(tests, document, names, PERIOD, chart_of, runtimes, unused)

    return tuple(_result(new_run(), test) for test in tests.tests)


def _unused(document: Document, names: Names) -> frozenset[str]:
    """Return the variables that no content and no start value of a document mentions."""
    used = repr((document.root, [one.init for one in document.data], document.constants))
    return frozenset(
        one.name for one in names.symbols.values()
        if one.kind == "var" and not re.search(rf"\b{one.name}\b", used)
    )  # fmt: skip


def _result(run: _Run, test: str) -> TestResult:
    try:
        run.call(test, ())
    except NotRun as error:
        return TestResult(test, Result.SKIPPED, str(error))
    except (Failed, FsmkitError) as error:
        return TestResult(test, Result.FAILED, str(error))
    except RecursionError:
        return TestResult(test, Result.SKIPPED, "operations call each other without end")
    return TestResult(test, Result.PASSED)


def find_tests(folder: Path) -> Iterator[tuple[Path, TestClass, Path]]:
    """Yield the files of tests below a folder, each with its tests and its statechart."""
    charts = {}
    for path in sorted(each for suffix in (".sct", ".ysc") for each in folder.rglob(f"*{suffix}")):
        found = NAMED.search(path.read_bytes()[:LARGEST_HEAD])
        charts[path.stem if found is None else found[1].decode("utf-8", "replace")] = path
    for path in sorted(folder.rglob("*.sctunit")):
        tests = read_tests(path)
        if tests is not None and tests.statechart in charts:
            yield path, tests, charts[tests.statechart]


def sctunit_verdicts(folder: Path, targets: Sequence[str]) -> Iterator[Verdict]:
    """Yield the verdict of each test below a folder: of the interpreter, generated C and Python."""
    kinds = {target: runtime(target) for target in targets if target in TARGETS}
    for path, _, chart in find_tests(folder):
        name = path.relative_to(folder).as_posix()
        for target in targets:
            if target == "interpreter" or target in kinds:
                others = [kinds[target]] if target in kinds else []
                for one in run_tests(path, chart, others):
                    case = Case(f"{name}: {one.test}", path, _evaluated, suite="SCTUnit")
                    yield Verdict(case, target, one.result, one.reason)


def _evaluated(chart: Chart, harness: Harness) -> None:
    raise AssertionError(f"{chart.name}, {harness.name}: tests of SCTUnit have their own runner")
