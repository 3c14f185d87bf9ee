"""Print the wires of a board in C: a header, a source, and a description in JSON.

``X_read`` reads a raw image, ``X_to_machines`` passes its meaning on, and ``X_from_machines``
creates the raw image from the outputs of the machines and devices. The called operations are
printed, too.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path

from fsmkit.carriers.wires.board import (
    Board,
    BoundEvent,
    BoundPort,
    Cases,
    Edge,
    Hysteresis,
    Kind,
    Origin,
    Register,
    Signal,
)
from fsmkit.carriers.wires.printing.formulas import FormulaPrinter, plain_name
from fsmkit.carriers.wires.printing.names import BoardNames, names_of
from fsmkit.codegen.c.expressions.types import parameter_type
from fsmkit.codegen.c.header import NOTICE, parameters
from fsmkit.codegen.c.storage import storage
from fsmkit.emit import Emitter, Namer, printing
from fsmkit.emit.c import comment, quoted
from fsmkit.language import BoolType, IntType
from fsmkit.language.conversion import integer_bounds
from fsmkit.language.types import Type
from fsmkit.system.machine import port_fields

FOLDER = Path(__file__).parents[1] / "c"
LIBRARY = ("fsm_io.h", "fsm_io.c")
SIGNED_BYTES = 4
"""Type of a member of the raw image."""


@printing
def compose_board(board: Board) -> dict[str, str]:
    """Return the files of a board: its wires, and the library that they need."""
    names = names_of(board)
    source = _Source(names).text()  # first: it finds which members are needed
    found = {
        f"{names.prefix}.h": _Header(names).text(),
        f"{names.prefix}.c": source,
        f"{names.prefix}.json": _description(names),
    }
    return found | {name: (FOLDER / name).read_text(encoding="utf-8") for name in LIBRARY}


def wires(board: Board) -> Iterator[tuple[int, Signal]]:
    """Yield the signals that are wires, in the order of the raw image: inputs first."""
    for is_output in (False, True):
        for number, signal in enumerate(board.signals):
            if signal.kind is not Kind.FLAG and signal.is_output is is_output:
                yield number, signal


def registers(board: Board) -> Iterator[tuple[int, Register, str]]:
    """Yield the registers and their wires: inputs first, each register in one run."""
    found = [
        (signal.is_output, signal.register.offset, signal.register.shift, place, signal)
        for place, (_, signal) in enumerate(wires(board))
        if signal.register is not None
    ]
    for *_, place, signal in sorted(found, key=lambda row: row[:4]):
        if signal.register is not None:
            yield place, signal.register, signal.name


def safe_raw(signal: Signal) -> int:
    """Return the safe value of a wire, as a raw value."""
    return signal.safe ^ signal.is_low if signal.is_output else 0


def bits_of(signal: Signal) -> int:
    """Return the number of bits of a raw value."""
    if isinstance(signal.type, BoolType):
        return 1
    return signal.bits


def _description(names: BoardNames) -> str:
    board = names.board
    found = {
        "board": board.name,
        "period_us": board.period,
        "signals": [
            {
                "name": signal.name,
                "kind": signal.kind.value,
                "number": signal.number,
                "offset": place * SIGNED_BYTES,
                "bits": bits_of(signal),
                "is_output": signal.is_output,
                "active_low": signal.is_low,
                "safe": safe_raw(signal),
                **({} if signal.register is None else {"register": asdict(signal.register)}),
            }
            for place, (_, signal) in enumerate(wires(board))
        ],
    }
    return json.dumps(found, indent=2, ensure_ascii=True) + "\n"


def ctype(signal: Signal) -> str:
    """Return the C type of a signal's meaning."""
    return "bool" if isinstance(signal.type, BoolType) else "int32_t"


def hystereses(board: Board) -> Iterator[Hysteresis]:
    """Yield each hysteresis of a board once."""
    origins: list[Origin] = [bound.origin for bound in board.inputs]
    origins += [bound.watched for bound in board.events]
    origins += [bound.origin for bound in board.following]
    found: dict[Hysteresis, None] = {}
    for origin in origins:
        bits = [bit for _, bit in origin.cases] if isinstance(origin, Cases) else [origin]
        found |= {bit: None for bit in bits if isinstance(bit, Hysteresis)}
    yield from found


class _Header:
    def __init__(self, names: BoardNames) -> None:
        self.names = names
        self.board = names.board
        self.out = Emitter()

    def text(self) -> str:
        """Return the file."""
        out, s = self.out, self.names.prefix
        upper = s.upper()
        count = len(list(wires(self.board)))
        out.line(f"/* {s}.h: the wires of the board {comment(self.board.name)}. {NOTICE} */")
        out.lines([f"#ifndef {upper}_H", f"#define {upper}_H", ""])
        headers = dict.fromkeys(device.header for device in self.board.devices)
        out.line('#include "fsm_io.h"')
        out.lines(f"#include {quoted(header)}" for header in headers)
        out.line(f'#include "{self.names.node.prefix}.h"')
        out.lines(["", "#ifdef __cplusplus", 'extern "C" {', "#endif", ""])
        out.line(f"#define {upper}_WIRES {count}u")
        out.line(f"#define {upper}_PERIOD_US {self.board.period}u")
        out.line(f"#define {upper}_WATCHDOG_MS {self.board.deployment.watchdog}u")
        out.line()
        self._raw()
        self._struct()
        rows = len(list(registers(self.board)))
        ends = [each.offset + each.access // 8 for _, each, _ in registers(self.board)]
        out.line("/* The wires: members of the raw image. */")
        out.line(f"extern const fsm_io_wire {s}_wires[{max(count, 1)}];")
        if rows:
            out.line(f"#define {upper}_REGISTERS {rows}u")
            out.line(f"#define {upper}_WINDOW {max(ends)}u /* bytes */")
            out.line(f"extern const fsm_io_register {s}_registers[{rows}];")
        out.line()
        out.text(f"""
        /* Create a board that has not been started, and its node. The host initialises the
         * devices, which are zero. Once in each cycle: read the hardware, update the machines, run
         * them ({self.names.node.prefix}_cycle), and compute the outputs of the hardware. */
        void {s}_init({s} *io);
        void {s}_read({s} *io, const {s}_raw *raw);
        void {s}_to_machines({s} *io);
        void {s}_from_machines({s} *io, {s}_raw *raw);
        """)
        out.lines(["", "#ifdef __cplusplus", "}", "#endif", "", "#endif"])
        return out.finish()

    def _raw(self) -> None:
        self.out.line(
            "/* The raw values of the hardware. A backend writes outputs, and reads inputs. */"
        )
        with self.out.block(
            f"typedef struct {self.names.prefix}_raw {{", f"}} {self.names.prefix}_raw;"
        ):
            found = list(wires(self.board))
            for number, signal in found:
                wire = f"{signal.kind.value} {signal.number}"
                self.out.line(f"int32_t {self.names.signals[number]}; /* {wire} */")
            if not found:
                self.out.line("int32_t none_;")
        self.out.line()

    def _struct(self) -> None:
        out, s = self.out, self.names.prefix
        out.line("/* The values, the devices, and the node. The host may read all; it sets")
        out.line(" * flags that are its own. */")
        with out.block(f"typedef struct {s} {{", f"}} {s};"):
            for group, chosen in (
                ("in", [n for n, each in enumerate(self.board.signals) if each.is_input]),
                ("out", [n for n, each in enumerate(self.board.signals) if each.is_output]),
                (
                    "flag",
                    [n for n, each in enumerate(self.board.signals) if each.kind is Kind.FLAG],
                ),
            ):
                if chosen:
                    with out.block("struct {", f"}} {group};"):
                        for number in chosen:
                            signal = self.board.signals[number]
                            note = f"{signal.type.lo}..{signal.type.hi}" if isinstance(
                                signal.type, IntType) else comment(signal.name)  # fmt: skip
                            out.line(f"{ctype(signal)} {self.names.signals[number]}; /* {note} */")
            own = list(self._own())
            if own:
                with out.block("struct { /* stored from cycle to cycle */", "} own;"):
                    out.lines(own)
            for number, device in enumerate(self.board.devices):
                out.line(f"{plain_name(device.type)} {self.names.devices[number]};")
            out.line(f"{self.names.node.prefix} node;")
        out.line()

    def _own(self) -> Iterator[str]:
        for number, signal in enumerate(self.board.signals):
            name = self.names.signals[number]
            if signal.kind is Kind.DIGITAL_IN and signal.debounce > 1:
                yield f"uint16_t {name};"
            elif signal.kind is Kind.COUNTER:
                yield f"fsm_io_counter {name};"
            elif signal.kind is Kind.ANALOG_IN:
                yield f"fsm_io_converter {name};"
            elif signal.kind is Kind.NUMBER_IN:
                yield f"uint16_t {name}_invalid;"
        for number, device in enumerate(self.board.devices):
            if device.notices:
                yield f"unsigned {self.names.devices[number]}_noticed; /* in this cycle */"
        for name in self.names.thresholds.values():
            yield f"bool {name};"
        for number, event in enumerate(self.board.events):
            if event.edge is Edge.CHANGED:
                yield f"int32_t was_{number};"
            elif event.edge is not Edge.ALWAYS:
                yield f"bool was_{number};"


class _Source:
    def __init__(self, names: BoardNames) -> None:
        self.names = names
        self.board = names.board
        self.out = Emitter()
        self.printer = FormulaPrinter(names)

    def text(self) -> str:
        """Return the file."""
        s = self.names.prefix
        for found in hystereses(self.board):
            self.names.threshold(found)
        self.out.line(f"/* {s}.c: see {s}.h. {NOTICE} */")
        self.out.lines([f'#include "{s}.h"', ""])
        self._table()
        self._init()
        self._read()
        self._to_machines()
        self._from_machines()
        for port in self.board.ports:
            self._port(port)
        return self.out.finish()

    def _table(self) -> None:
        s = self.names.prefix
        found = list(wires(self.board))
        for number, signal in enumerate(self.board.signals):
            if signal.kind is Kind.ANALOG_IN:
                self._scale(number, signal)
        count = max(len(found), 1)
        with self.out.block(f"const fsm_io_wire {s}_wires[{count}] = {{", "};"):
            for number, signal in found:
                member = f"offsetof({s}_raw, {self.names.signals[number]})"
                kind, safe = f"FSM_IO_{signal.kind.name}", number_of(safe_raw(signal))
                full = signal.type.hi if isinstance(signal.type, IntType) else 0
                full = full if signal.kind is Kind.PWM else 0
                row = f"{signal.number}u, {kind}, {bits_of(signal)}u, {safe}, {full}, "
                row += str(signal.is_kept).lower()
                self.out.line(f"{{{quoted(signal.name)}, {member}, {row}}},")
            if not found:
                self.out.line("{NULL, 0u, 0u, 0u, 0u, 0, 0, false}")
        self.out.line()

        rows = list(registers(self.board))
        if rows:
            with self.out.block(f"const fsm_io_register {s}_registers[{len(rows)}] = {{", "};"):
                for place, register, name in rows:
                    fields = f"{register.access}u, {register.shift}u, {register.bits}u"
                    fields += f", {str(register.is_signed).lower()}"
                    row = f"{{{register.offset}u, {place}u, {fields}}},"
                    self.out.line(f"{row} /* {comment(name)} */")
            self.out.line()

    def _scale(self, number: int, signal: Signal) -> None:
        name = self.names.signals[number]
        points = ", ".join(f"{{{number_of(x)}, {number_of(y)}}}" for x, y in signal.points)
        least, greatest = map(number_of, signal.valid)
        self.out.lines([
            f"static const fsm_io_point {name}_points[] = {{{points}}};",
            (f"static const fsm_io_scale {name}_scale = {{{name}_points, {len(signal.points)}u, "
            f"{signal.lowpass}u, {least}, {greatest}}};"),
            "",
        ])  # fmt: skip

    def _init(self) -> None:
        s = self.names.prefix
        with self.out.function(f"void {s}_init({s} *io)"):
            self.out.line("unsigned char *const bytes = (unsigned char *)io;")
            self.out.line("for (size_t i = 0u; i < sizeof *io; i++)")
            self.out.line("    bytes[i] = 0u;")
            for number, signal in enumerate(self.board.signals):
                value = signal.safe
                if signal.is_input and isinstance(signal.type, IntType):
                    value = min(max(signal.type.lo, 0), signal.type.hi)
                if value:
                    text = "true" if isinstance(signal.type, BoolType) else number_of(value)
                    self.out.line(f"{self.names.value(number)} = {text};")
            self.out.line(f"{self.names.node.prefix}_init(&io->node);")

    def _read(self) -> None:
        s = self.names.prefix
        with self.out.function(f"void {s}_read({s} *io, const {s}_raw *raw)"):
            inputs = [n for n, signal in enumerate(self.board.signals) if signal.is_input]
            if not inputs:
                self.out.lines(["(void)io;", "(void)raw;"])
            for number in inputs:
                self.out.line(self._reading(number))

    def _reading(self, number: int) -> str:
        signal, name = self.board.signals[number], self.names.signals[number]
        value, own = self.names.value(number), f"io->own.{name}"
        match signal.kind:
            case Kind.DIGITAL_IN:
                test = f"raw->{name} {'==' if signal.is_low else '!='} 0"
                if signal.debounce == 1:
                    return f"{value} = {test};"
                return f"fsm_io_debounce(&{value}, &{own}, {test}, {signal.debounce}u);"
            case Kind.COUNTER:
                return f"fsm_io_count(&{value}, &{own}, raw->{name}, {signal.bits}u);"
            case Kind.ANALOG_IN:
                return f"fsm_io_convert(&{value}, &{own}, &{name}_scale, raw->{name});"
            case _:
                least, greatest = map(number_of, signal.valid)
                return f"fsm_io_number(&{value}, &{own}_invalid, raw->{name}, {least}, {greatest});"

    # --- to the machines --------------------------------------------------------------------------

    def _to_machines(self) -> None:
        s, out = self.names.prefix, self.out
        with out.function(f"void {s}_to_machines({s} *io)"):
            before = len(out.finish())
            self._senses()
            for found in hystereses(self.board):
                signal = self.names.value(found.signal)
                out.line(
                    f"fsm_io_hysteresis(&{self.names.threshold(found)}, {signal}, "
                    f"{number_of(found.above)}, {number_of(found.below)});"
                )
            for bound in self.board.following:
                if self.board.signals[bound.signal].kind is Kind.FLAG:
                    out.line(
                        f"{self.names.value(bound.signal)} = {self.printer.bit(bound.origin)};"
                    )
            for input_ in self.board.inputs:
                part = self.names.parts[input_.machine]
                variable = part.chart.inputs[input_.input]
                target = f"io->node.{part.member}.{part.names.variables[variable.name]}"
                text = self._stored(input_.origin, variable.type)
                out.line(f"{target} = {text};")
            for number, event in enumerate(self.board.events):
                self._event(number, event)
            if len(out.finish()) == before:
                out.line("(void)io;")

    def _stored(self, origin: Origin, type_: Type) -> str:
        """Return a value as it is stored in a machine."""
        text = self.printer.origin(origin)
        if isinstance(type_, BoolType):
            return text
        return f"({storage(type_, {}).text})({text})"

    def _senses(self) -> None:
        """Let each device read its signals."""
        for number, device in enumerate(self.board.devices):
            if not device.reads and not device.notices:
                continue
            member = self.names.devices[number]
            values = "".join(f", {self.names.value(signal)}" for signal in device.reads)
            call = f"{plain_name(device.type)}_sense(&io->{member}{values})"
            target = f"io->own.{member}_noticed = " if device.notices else ""
            self.out.line(f"{target}{call};")

    def _event(self, number: int, event: BoundEvent) -> None:
        out = self.out
        watched = self.printer.bit(event.watched)
        was = f"io->own.was_{number}"
        tests = {
            Edge.ALWAYS: "is",
            Edge.RISING: f"is && !{was}",
            Edge.FALLING: f"!is && {was}",
            Edge.CHANGED: f"is != {was}",
        }
        test = tests[event.edge]
        if event.condition is not None:
            test += f" && {self.printer.formula(event.condition, is_inner=True)}"
        part = self.names.parts[event.machine]
        with out.block(f"{{ /* {comment(part.names.event_names[event.event])} */"):
            kind = "int32_t" if event.edge is Edge.CHANGED else "bool"
            out.line(f"const {kind} is = {watched};")
            with out.block(f"if ({test}) {{"):
                self._post(event)
            if event.edge is not Edge.ALWAYS:
                out.line(f"{was} = is;")

    def _post(self, event: BoundEvent) -> None:
        out, part = self.out, self.names.parts[event.machine]
        names = part.names
        out.line(f"{part.prefix}_event e = {names.upper}_NO_EVENT;")
        out.line(f"e.event = {names.events[event.event]};")
        fields = part.chart.events[event.event].fields
        for field, value in zip(fields, event.values, strict=True):
            into = f"e.of.{names.payloads[event.event]}.{names.field(field.name)}"
            out.line(f"{into} = {self._stored(value, field.type)};")
        out.line(f"(void){part.prefix}_post(&io->node.{part.member}, &e);")

    # --- from the machines ------------------------------------------------------------------------

    def _from_machines(self) -> None:
        s, out = self.names.prefix, self.out
        outputs = [n for n, signal in enumerate(self.board.signals) if signal.is_output]
        with out.function(f"void {s}_from_machines({s} *io, {s}_raw *raw)"):
            off = self.board.off
            for number, device in enumerate(self.board.devices):
                if device.writes:
                    member = self.names.devices[number]
                    places = "".join(f", &{self.names.value(n)}" for n in device.writes)
                    out.line(f"{plain_name(device.type)}_act(&io->{member}{places});")
            for bound in self.board.following:
                if self.board.signals[bound.signal].is_output:
                    out.line(
                        f"{self.names.value(bound.signal)} = {self.printer.bit(bound.origin)};"
                    )
            if not outputs:
                out.lines(["(void)io;", "(void)raw;"])
            elif off is not None:
                out.line(f"if ({self.printer.formula(off)}) {{")
                with out.indented():
                    for number in outputs:
                        signal = self.board.signals[number]
                        if not signal.is_kept:
                            out.line(
                                f"raw->{self.names.signals[number]} = "
                                f"{number_of(safe_raw(signal))};"
                            )
                    out.lines(self._written(n) for n in outputs if self.board.signals[n].is_kept)
                    out.line("return;")
                out.line("}")
            out.lines(self._written(number) for number in outputs)

    def _written(self, number: int) -> str:
        signal, name = self.board.signals[number], self.names.signals[number]
        value = self.names.value(number)
        if isinstance(signal.type, BoolType):
            return f"raw->{name} = {'!' if signal.is_low else ''}{value};"
        least, greatest = number_of(signal.type.lo), number_of(signal.type.hi)
        return f"raw->{name} = fsm_io_clamp({value}, {least}, {greatest});"

    # --- outgoing events and operations ----------------------------------------------------------

    def _port(self, port: BoundPort) -> None:
        out, s = self.out, self.names.prefix
        part = self.names.parts[port.machine]
        names, chart = part.names, part.chart
        fields = port_fields(chart, port.port)
        io = Namer(names.field(field.name) for field in fields).name("io")
        board = replace(self.names, pointer=io, is_used=False)
        printer = FormulaPrinter(board, (port.machine, port.port))
        result = None
        if port.port < len(chart.events):
            name = f"{part.prefix}_send_{names.event_names[port.port]}"
        else:
            operation = chart.operations[port.port - len(chart.events)]
            result = operation.result
            name = f"{part.prefix}_{names.operations[operation.name]}"
        told = self.names.told.get((port.machine, port.port))
        pointer, offset = ("m", f"offsetof({s}, node.{part.member})")
        first = f"{part.prefix} *m"
        if told is not None:
            name, pointer, offset = told, "s", f"offsetof({s}, node)"
            first = f"{self.names.node.prefix} *s"
        lines = [f"{board.value(n)} = {printer.formula(value)};" for n, value in port.sets]
        lines += self._returned(port, printer, result)
        returned = "void" if result is None else parameter_type(result, names)
        with out.function(f"{returned} {name}({first}{parameters(fields, names)})"):
            if board.is_used:
                out.line(
                    f"{s} *const {io} = ({s} *)(void *)((unsigned char *){pointer} - {offset});"
                )
            else:
                out.line(f"(void){pointer};")
            for place, field in enumerate(fields):
                if place not in printer.parameters:
                    out.line(f"(void){names.field(field.name)};")
            out.lines(lines)

    def _returned(
        self, port: BoundPort, printer: FormulaPrinter, result: Type | None
    ) -> Iterator[str]:
        """Yield the call of a device, and the result of the operation."""
        if result is None:
            if port.call is not None:
                yield f"(void){printer.query(port.call)};"
            return
        names = self.names.parts[port.machine].names
        if port.result is not None:
            text = printer.formula(port.result)
        else:
            assert port.call is not None  # noqa: S101  (the reader requires one of both)
            text = printer.query(port.call)
            span = integer_bounds(result)
            if not isinstance(result, BoolType) and span is not None:
                text = f"fsm_io_clamp({text}, {number_of(span[0])}, {number_of(span[1])})"
        cast = "" if isinstance(result, BoolType) else f"({parameter_type(result, names)})"
        yield f"return {cast}({text});" if cast else f"return {text};"


def number_of(value: int) -> str:
    """Return a number within 32 bits."""
    return "INT32_MIN" if value == -(2**31) else str(value) if value >= 0 else f"({value})"
