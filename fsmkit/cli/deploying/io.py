"""``fsmkit io``: the wires of a board by hand, to see whether they are connected."""

from __future__ import annotations

import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import NoReturn

import click
from rich.table import Table
from rich.text import Text

from fsmkit.carriers.wires.board import Board, Signal
from fsmkit.carriers.wires.meaning import meaning, raw_of
from fsmkit.carriers.wires.registers import Place, Registers
from fsmkit.cli.common.console import print_json, result
from fsmkit.cli.common.options import OneOf, Reading, path_option, read_span, reading_options
from fsmkit.cli.common.verbs import verb
from fsmkit.diagnostics import fail
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.emit import plain
from fsmkit.system.any_file import read_board

EPILOG = """\b
Examples:
  fsmkit io board_a.io.yaml --map /dev/mem --from 0x43C00000 show
  fsmkit io board_a.io.yaml --map window set lamp on
  fsmkit io board_a.io.yaml --map window watch --for 10s
"""
SHORTEST = 0.001
"""Seconds between two samples of ``watch``."""


def read_number(context: click.Context, option: click.Parameter, text: str) -> int:
    """Return the value of ``--from``, such as ``0x43C00000``."""
    del context, option
    try:
        number = int(text, 0)
    except ValueError:
        number = -1
    if number < 0:
        raise click.BadParameter(f"`{text}` is not an address")
    return number


@verb(EPILOG, Model=("parameters",))
@click.argument("file", type=click.Path(path_type=Path))
@click.argument("action", type=OneOf("action", ("show", "set", "watch")))
@click.argument("words", nargs=-1, metavar="[NAME VALUE]")
@path_option(
    "--map",
    "window",
    required=True,
    help="Map this file: shared memory, or /dev/mem.",
)
@click.option(
    "--from", "start", callback=read_number, default="0", help="Skip this many bytes of the file."
)
@click.option("--for", "span", callback=read_span, default="1h", help="Watch for this long.")
@click.option("--inputs", is_flag=True, help="Allow inputs to be set, for boards without hardware.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document (show).")
@reading_options
def command(
    file: Path,
    action: str,
    words: tuple[str, ...],
    window: Path,
    start: int,
    span: float,
    inputs: bool,
    as_json: bool,
    reading: Reading,
) -> int:
    """Show, set or watch the wires of a board.

    The wires are registers of a mapped file. A value stays until the program of the board, if
    it runs, writes the next cycle.
    """
    if len(words) != (2 if action == "set" else 0):
        raise click.UsageError("write `set NAME VALUE`, `show` or `watch`")
    board = read_board(file, reading.findings(), strict=reading.strict)
    if not isinstance(board, Board):
        raise fail("broken-board", f"`{file}` has no wires", help="name a file with `signals`")
    signals = {plain(s.name): s for s in board.signals if s.register is not None}
    if not signals:
        raise fail(
            "broken-board",
            f"the wires of `{file}` have no registers",
            help="write for instance `register: 0x10` at each",
        )
    places = {
        name: Place(r.offset, r.access, r.shift, r.bits, r.is_signed, signal.is_output)
        for name, signal in signals.items()
        if (r := signal.register) is not None
    }
    try:
        registers = Registers(window, places, start=start)
    except (OSError, ValueError, OverflowError) as error:
        raise fail(
            "unreadable-file", f"`{window}` cannot be mapped: {error}",
            help="it must be as long as the registers, and `--from` a multiple of a page",
        ) from None  # fmt: skip
    with registers:
        if action == "set":
            _set(registers, signals, *words, inputs=inputs)
        elif action == "watch":
            with suppress(KeyboardInterrupt):
                _watch(registers, signals, span, max(SHORTEST, board.period / 1e6))
        elif as_json:
            print_json({"signals": [_data(registers, signal) for signal in signals.values()]})
        else:
            result.print(_table(registers, signals))
    return 0


def _table(registers: Registers, signals: Mapping[str, Signal]) -> Table:
    table = Table(box=None, pad_edge=False)
    for heading in ("signal", "kind", "", "raw", "means"):
        table.add_column(heading, justify="right" if heading in ("", "raw", "means") else "left")
    for name, signal in signals.items():
        raw = registers.get(name)
        told = meaning(signal, raw) or "not valid"
        texts = (name, signal.kind.value, str(signal.number), str(raw), told)
        table.add_row(*(Text(text) for text in texts))
    return table


def _data(registers: Registers, signal: Signal) -> dict[str, object]:
    raw = registers.get(plain(signal.name))
    return {
        "name": signal.name,
        "kind": signal.kind.value,
        "number": signal.number,
        "raw": raw,
        "means": meaning(signal, raw) or None,
    }


def _set(
    registers: Registers, signals: Mapping[str, Signal], name: str, text: str, *, inputs: bool
) -> None:
    signal = signals.get(name)
    if signal is None:
        _reject(f"there is no wire `{name}`", suggest(name, signals, "see `show`"))
    if signal.is_input and not inputs:
        _reject(f"`{name}` is an input", "hardware sets it; set a fake with `--inputs`")
    raw = raw_of(signal, text)
    if raw is None:
        what = "on or off" if str(signal.type) == "bool" else f"within {signal.type}"
        _reject(f"`{name}` cannot be `{text}`", f"it is {what}")
    registers.set(name, raw)


def _reject(message: str, advice: str | None) -> NoReturn:
    raise fail("unknown-name" if "no wire" in message else "unfit-wire", message, help=advice)


def _watch(registers: Registers, signals: Mapping[str, Signal], span: float, period: float) -> None:
    """Print a line for each wire at first, and for each change."""
    started = time.monotonic()
    last: dict[str, int] = {}
    while (now := time.monotonic() - started) <= span:
        for name, signal in signals.items():
            raw = registers.get(name)
            if last.get(name) != raw:
                last[name] = raw
                text = meaning(signal, raw) or "not valid"
                result.print(f"{now:9.3f} {name} {text}", markup=False, highlight=False)
        time.sleep(period)
