"""Reads what values of a board are made of: expressions, hysteresis, validity, calls of devices."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from fsmkit.carriers.wires import keys as wire_keys
from fsmkit.carriers.wires.board import (
    Bit,
    Cases,
    Device,
    Formula,
    Hysteresis,
    Invalid,
    Kind,
    Meaning,
    Notice,
    Origin,
    Parameter,
    Query,
    Signal,
    Wire,
    type_name,
)
from fsmkit.carriers.wires.signals import GREATEST, LEAST, MOST_READINGS
from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.emit import Namer
from fsmkit.language import (
    BOOL,
    BinaryOp,
    BoolType,
    EnumType,
    Field,
    FloatType,
    IntType,
    Literal,
    Scope,
    Storage,
    Type,
    UnaryOp,
    Variable,
    fold,
    read_duration,
)
from fsmkit.language.conversion import fits, integer_bounds
from fsmkit.language.tree import Binary, Conditional, Convert, Expr, Unary
from fsmkit.language.walk import subexpressions
from fsmkit.system.conditions import read_expression
from fsmkit.system.deployment.deployment import Deployment
from fsmkit.system.indices import integer
from fsmkit.yaml.nodes import Mapping as Entries
from fsmkit.yaml.nodes import Node, check_keys, entries_of, require_text, texts_of
from fsmkit.yaml.nodes import Sequence as Items

CALLED = re.compile(r"\s*([A-Za-z_]\w*)\s*\.\s*([A-Za-z_]\w*)\s*", re.ASCII)
COMPARISONS = {
    BinaryOp.EQ, BinaryOp.NE, BinaryOp.LT, BinaryOp.LE, BinaryOp.GT, BinaryOp.GE,
}  # fmt: skip
OPERATORS = COMPARISONS | {BinaryOp.AND, BinaryOp.OR, BinaryOp.ADD, BinaryOp.SUB, BinaryOp.MUL}


@dataclass
class FormulaReader:
    """Reads values; notes which signals are read."""

    deployment: Deployment
    node: int
    period: int
    signals: tuple[Signal, ...]
    devices: tuple[Device, ...]
    findings: Findings
    read: set[int] = field(default_factory=set)
    chart: Chart | None = None
    """The machine whose bindings are read: its constants and types are visible."""
    parameters: tuple[Field, ...] = ()
    """The operation, or the outgoing event, whose binding is read."""

    # --- names ------------------------------------------------------------------------------------

    def _names(self) -> tuple[dict[str, tuple[str, Type]], dict[str, Meaning]]:
        """Return how names are written, with their variables and types, and what these mean."""
        namer = Namer()
        written: dict[str, tuple[str, Type]] = {}
        meanings: dict[str, Meaning] = {}
        found: list[tuple[str, Meaning, Type]] = []
        for number, signal in enumerate(self.signals):
            found.append((signal.name, Wire(number), signal.type))
        for number, device in enumerate(self.devices):
            for bit, notice in enumerate(device.notices):
                found.append((f"{device.name}.{notice}", Notice(number, bit), BOOL))
        for place, parameter in enumerate(self.parameters):
            found.append((parameter.name, Parameter(place), parameter.type))
        for name, meaning, type_ in found:
            variable = namer.name(f"wire__{name}")
            written[str(name)] = variable, type_
            meanings[variable] = meaning
        return written, meanings

    def signal(self, text: Text) -> int | None:
        """Return the number of a signal; None after a finding."""
        name = re.sub(r"\s", "", text.value)
        for number, signal in enumerate(self.signals):
            if signal.name == name:
                return number
        known = [str(signal.name) for signal in self.signals]
        self.findings.add(
            "unknown-name",
            f"there is no signal `{text}`",
            text,
            help=suggest(name, known, "declare it under `signals`"),
        )
        return None

    def device(self, text: Text) -> int | None:
        """Return the number of a device; None after a finding."""
        known = [str(device.name) for device in self.devices]
        if text.value in known:
            return known.index(text.value)
        self.findings.add(
            "unknown-name",
            f"there is no device `{text}`",
            text,
            help=suggest(text.value, known, "declare it under `use`"),
        )
        return None

    def is_call(self, text: Text) -> bool:
        """Whether a text names a function of a device, and no signal or notice."""
        match = CALLED.fullmatch(text.value)
        if match is None:
            return False
        name = f"{match[1]}.{match[2]}"
        devices = {str(device.name): device for device in self.devices}
        if match[1] not in devices or match[2] in devices[match[1]].notices:
            return False
        return name not in {str(signal.name) for signal in self.signals}

    # --- expressions ------------------------------------------------------------------------------

    def formula(
        self, text: Text, wanted: Type | None, what: str, declared: Span | None = None
    ) -> Formula | None:
        """Read an expression that gives a value of a type; ``declared``: where that is.

        None after a finding. Without a type any number, bit or member of an enumeration does.
        """
        names, meanings = self._names()
        condition = read_expression(
            text,
            self.deployment.system.machines,
            self.findings,
            wanted if isinstance(wanted, EnumType) else None,
            others=names,
            chart=self.chart,
        )
        if condition is None:
            return None
        expression = fold(condition.expression)
        if not self._can_be_computed(expression) or not self._has_hysteresis(expression, meanings):
            return None
        used = {part.name for part in subexpressions(expression) if isinstance(part, Variable)}
        found: dict[str, Meaning] = {n: m for n, m in meanings.items() if n in used}
        for name, atom in condition.atoms:
            machine = self.deployment.system.machines[atom.machine]
            if self.deployment.placed[atom.machine] != self.node:
                self.findings.add(
                    "broken-board",
                    f"`{machine.name}` does not run on this board",
                    text,
                    help="let an event or an output of it lead to a machine of this board",
                )
                return None
            if atom.event is not None:
                self.findings.add(
                    "unfit-wire",
                    "a board does not see which events its machines take",
                    text,
                    help="let the machine show it in an output",
                )
                return None
            found[name] = atom
        self.read |= {meaning.signal for meaning in found.values() if isinstance(meaning, Wire)}
        type_ = expression.type
        if wanted is not None and (type_ is None or not fits(type_, wanted)):
            given = "nothing" if type_ is None else type_name(type_)
            self.findings.add(
                "unfit-wire",
                f"`{text}` is `{given}`, and {what} `{type_name(wanted)}`",
                text,
                secondary=[] if declared is None else [(declared, "declared here")],
                help="scale or narrow the signal, or declare a wider range",
            )
            return None
        return Formula(expression, found)

    def _can_be_computed(self, expression: Expr) -> bool:
        """Report what cannot be computed in 32 bits without failing."""
        for part in subexpressions(expression):
            match part:
                case Literal() | Variable() | Conditional():
                    is_known = True
                case Convert(operand, type_):
                    is_known = operand.type is not None and fits(operand.type, type_)
                case Unary(op):
                    is_known = op in (UnaryOp.NOT, UnaryOp.NEGATE)
                case Binary(op):
                    is_known = op in OPERATORS
                case _:
                    is_known = False
            span = integer_bounds(part.type)
            if is_known and not isinstance(part.type, FloatType) and span is not None:
                if span[0] >= LEAST and span[1] <= GREATEST:
                    continue
                message = f"the values {span[0]}..{span[1]} do not fit into 32 bits"
            else:
                message = "boards compute with bits and whole numbers: and, or, not, + - *, ? :"
            self.findings.add(
                "unfit-wire", message, part.span, help="compute this in a machine or a device"
            )
            return False
        return True

    def _has_hysteresis(self, expression: Expr, meanings: Mapping[str, Meaning]) -> bool:
        """Report a comparison whose result noise can change, and return False; True without one."""
        for part in subexpressions(expression):
            if not isinstance(part, Binary) or part.op not in COMPARISONS:
                continue
            for name in subexpressions(part):
                meaning = meanings.get(name.name) if isinstance(name, Variable) else None
                if not isinstance(meaning, Wire):
                    continue
                signal = self.signals[meaning.signal]
                if signal.kind is Kind.ANALOG_IN:
                    self.findings.add(
                        "bare-comparison",
                        f"noise on `{signal.name}` makes this true and false in turn",
                        part.span,
                        help=f"write `{{of: {signal.name}, above: 600, below: 580}}`",
                    )
                    return False
        return True

    def of_parameter(self, place: int, field_: Field) -> Formula:
        """Return the value of a parameter of an output event, a call or a level of a machine."""
        span = self.deployment.system.machines[0].span
        assert span is not None  # noqa: S101  (it was read from a file)
        variable = Variable("wire__it", field_.type, Storage.INPUT, span)
        return Formula(variable, {"wire__it": Parameter(place)})

    # --- other origins ----------------------------------------------------------------------------

    def bit(self, node: Node, what: str, declared: Span | None = None) -> Bit | None:
        """Read where a bit comes from."""
        found = self.origin(node, BOOL, what, declared)
        if isinstance(found, Cases):
            self.findings.add(
                "unexpected-shape", f"{what} is one condition", node.span, help="write it out"
            )
            return None
        return found

    def origin(
        self, node: Node, wanted: Type, what: str, declared: Span | None = None
    ) -> Origin | None:
        """Read where a value comes from: an expression, or one of `wire_keys.SOURCES`."""
        if not isinstance(node, Entries):
            text = require_text(node, what, self.findings)
            return None if text is None else self.formula(text, wanted, f"{what} is", declared)
        given = [key.value for key, _ in node.entries]
        kind = next((k for k in ("is", "when", "call", "invalid", "of") if k in given), None)
        if kind is None:
            known = ", ".join(f"`{key}`" for key in wire_keys.SOURCES)
            self.findings.add(
                "unexpected-shape",
                f"{what} comes from nowhere",
                node.span,
                help=f"write an expression, or keys with one of {known}",
            )
            return None
        check_keys(node, wire_keys.SOURCES[kind], f"a value with `{kind}`", self.findings)
        parts = {key.value: value for key, value in node.entries}
        if kind == "when":
            return self._cases(parts, wanted, what)
        if not isinstance(wanted, BoolType) and kind != "call":
            self.findings.add(
                "unfit-wire",
                f"`{kind}` gives a bit, and {what} is `{type_name(wanted)}`",
                node.span,
                secondary=[] if declared is None else [(declared, "declared here")],
            )
            return None
        match kind:
            case "of":
                return self._hysteresis(node, parts)
            case "invalid":
                return self._invalid(node, parts)
            case "is":
                return self._is(node, parts)
            case _:
                return self.query(parts)

    def _signal_of(self, parts: Mapping[str, Node], key: str, kinds: Sequence[Kind]) -> int | None:
        text = require_text(parts.get(key), f"`{key}`", self.findings)
        number = None if text is None else self.signal(text)
        if number is None:
            return None
        signal = self.signals[number]
        if signal.kind not in kinds:
            self.findings.add(
                "unfit-wire",
                f"`{signal.name}` is of the kind `{signal.kind.value}`",
                text,
                help=f"name one of the kind {' or '.join(f'`{kind.value}`' for kind in kinds)}",
            )
            return None
        self.read.add(number)
        return number

    def _hysteresis(self, node: Entries, parts: Mapping[str, Node]) -> Hysteresis | None:
        kinds = (Kind.ANALOG_IN, Kind.NUMBER_IN, Kind.COUNTER)
        signal = self._signal_of(parts, "of", kinds)
        texts = [require_text(parts.get(k), f"`{k}`", self.findings) for k in ("above", "below")]
        if any(text is None for text in texts):
            self.findings.add(
                "bare-comparison",
                "a hysteresis has two thresholds",
                node.span,
                help="write `above`, from which it is true, and `below`, from which it is false",
            )
            return None
        numbers = [integer(text, self.findings) for text in texts if text is not None]
        if signal is None or numbers[0] is None or numbers[1] is None:
            return None
        above, below = numbers[0], numbers[1]
        type_ = self.signals[signal].type
        assert isinstance(type_, IntType)  # noqa: S101  (of these kinds)
        if not type_.lo < below <= above < type_.hi:
            self.findings.add(
                "unfit-wire",
                f"`above: {above}` and `below: {below}` are no thresholds of "
                f"`{self.signals[signal].name}`, which is {type_name(type_)}",
                node.span,
                help="`below` is not greater than `above`, and the signal goes beyond both",
            )
            return None
        return Hysteresis(signal, above, below)

    def _invalid(self, node: Entries, parts: Mapping[str, Node]) -> Invalid | None:
        signal = self._signal_of(parts, "invalid", (Kind.ANALOG_IN, Kind.NUMBER_IN))
        text = require_text(parts.get("for"), "`for`", self.findings)
        micros = None if text is None else read_duration(text, Scope(tick=1), self.findings)
        if signal is None or (text is not None and micros is None):
            return None
        readings = max(1, -(-(micros or 0) // self.period))
        if readings > MOST_READINGS:
            self.findings.add(
                "broken-board", f"`for` is longer than {MOST_READINGS} cycles", node.span
            )
            return None
        return Invalid(signal, readings)

    def _is(self, node: Entries, parts: Mapping[str, Node]) -> Formula | None:
        kinds = (Kind.NUMBER_IN, Kind.COUNTER, Kind.DIGITAL_IN, Kind.FLAG)
        signal = self._signal_of(parts, "of", kinds)
        value = require_text(parts["is"], "`is`", self.findings)
        if signal is None or value is None:
            if "of" not in parts:
                self.findings.add(
                    "unexpected-shape", "`is` needs `of`, the signal", node.span,
                    help="write `{is: 1, of: camera.verdict}`",
                )  # fmt: skip
            return None
        known = self.signals[signal]
        constant = self.formula(value, known.type, f"`{known.name}` is", known.span)
        if constant is None:
            return None
        if not isinstance(constant.expression, Literal):
            self.findings.add("unfit-wire", "this is no constant", value, help="write a number")
            return None
        span = value.span
        variable = Variable("wire__it", known.type, Storage.INPUT, span)
        test = Binary(BinaryOp.EQ, variable, constant.expression, BOOL, span)
        return Formula(test, {"wire__it": Wire(signal)})

    def query(self, parts: Mapping[str, Node]) -> Query | None:
        """Read a call: ``call`` and ``with``, a value or a list of them."""
        text = require_text(parts.get("call"), "`call`", self.findings)
        if text is None:
            return None
        match = CALLED.fullmatch(text.value)
        if match is None:
            self.findings.add(
                "unexpected-value", f"`{text}` is no function of a device", text,
                help="write `device.function`",
            )  # fmt: skip
            return None
        device = self.device(text.part(*match.span(1)))
        given = parts.get("with")
        if given is None or isinstance(given, Items):
            texts = list(texts_of(given, "`with`", "an argument", self.findings))
        else:
            one = require_text(given, "`with`", self.findings)
            texts = [] if one is None else [one]
        values = [self.formula(each, None, "an argument is") for each in texts]
        arguments = tuple(value for value in values if value is not None)
        if device is None or len(arguments) < len(values):
            return None
        return Query(device, match[2], arguments)

    def _cases(self, parts: Mapping[str, Node], wanted: Type, what: str) -> Cases | None:
        found: list[tuple[int, Bit]] = []
        for key, value in entries_of(parts["when"], "`when`", self.findings):
            number = self._constant(key, wanted, what)
            bit = self.bit(value, f"when {what} is `{key}`")
            if number is None or bit is None:
                return None
            found.append((number, bit))
        otherwise = require_text(parts.get("else"), "`else`", self.findings)
        if otherwise is None:
            self.findings.add(
                "missing-key",
                f"{what} has no value where no condition holds",
                parts["when"].span,
                help="write `else: value`",
            )
            return None
        rest = self._constant(otherwise, wanted, what)
        return None if rest is None else Cases(tuple(found), rest)

    def _constant(self, text: Text, wanted: Type, what: str) -> int | None:
        formula = self.formula(text, wanted, f"{what} is")
        if formula is None:
            return None
        if isinstance(formula.expression, Literal):
            return int(formula.expression.value)  # type: ignore[arg-type]
        self.findings.add(
            "not-known-when-compiling", f"`{text}` is no constant", text, help="write a constant"
        )
        return None
