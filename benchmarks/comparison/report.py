"""The tables of a run: on a terminal and in Markdown, from the same rows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from benchmarks.comparison.figures import AIMS, FSMKIT, LIMIT, Machine, Results, limit, ratio

MISSING = "-"
FIGURES_OF_PARTS = {
    "code_m0": "M0",
    "code_x64": "x64",
    "ram_m0": "RAM",
    "instructions": "instr",
}


@dataclass(frozen=True, slots=True)
class Sheet:
    """A table of texts; the first column names, the others are numbers."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    groups: tuple[int, ...] = ()
    """Rows before which a new group begins."""


def sheets(results: Results) -> list[Sheet]:
    """Return all tables of a run that have rows."""
    all_sheets = [instructions(results), sizes(results), prices(results), speeds(results)]
    return [sheet for sheet in all_sheets if sheet.rows]


def instructions(results: Results) -> Sheet:
    """Return the table of the cost of an event in C."""

    def row(machine: Machine) -> tuple[str, ...]:
        least = limit(results.machines, machine.chart, "instructions")
        return (
            machine.chart,
            named(machine),
            number(machine.instructions, 1),
            number(ratio(machine.instructions, least), 2),
            evaluated(machine, machine.instructions, AIMS[machine.chart].instructions),
            verdict(machine),
        )

    columns = ("chart", "machine", "instr/event", "x limit", "aim", "digests")
    return _of_machines("C, instructions an event: x86-64, gcc -O2", columns, results, row)


def sizes(results: Results) -> Sheet:
    """Return the table of the bytes of machines in C."""

    def row(machine: Machine) -> tuple[str, ...]:
        least = limit(results.machines, machine.chart, "code_m0")
        aim = AIMS[machine.chart]
        return (
            machine.chart,
            named(machine),
            number(machine.code_m0),
            number(ratio(machine.code_m0, least), 2),
            evaluated(machine, machine.code_m0, aim.code),
            number(machine.code_x64),
            number(machine.ram_m0),
            number(machine.ram_x64),
            evaluated(machine, machine.ram_m0, aim.ram),
        )

    columns = (
        "chart", "machine", "M0 code", "x limit", "aim", "x64 code", "M0 RAM", "x64 RAM", "aim",
    )  # fmt: skip
    return _of_machines(
        "C, bytes: Cortex-M0 -Os and x86-64 -O2; RAM beside the user's variables",
        columns, results, row,
    )  # fmt: skip


def _of_machines(
    title: str,
    columns: tuple[str, ...],
    results: Results,
    row: Callable[[Machine], tuple[str, ...]],
) -> Sheet:
    charts = [machine.chart for machine in results.machines]
    groups = tuple(i for i in range(1, len(charts)) if charts[i] != charts[i - 1])
    return Sheet(title, columns, tuple(map(row, results.machines)), groups)


def named(machine: Machine) -> str:
    """Return the name of a machine, with whether it is written by hand."""
    return f"{machine.name} ({LIMIT})" if machine.kind == LIMIT else machine.name


def verdict(machine: Machine) -> str:
    """Return in words whether a machine did the work of the model."""
    if not machine.is_correct:
        return "WRONG"
    if machine.is_ordered is None:
        return "equal, order not shown"
    return "equal" if machine.is_ordered else "equal, other order"


def prices(results: Results) -> Sheet:
    """Return the table of the costs of parts: a column for each known figure and each chart."""
    charts = sorted({price.chart for price in results.prices})
    parts = dict.fromkeys((price.name, price.part) for price in results.prices)
    found = {(price.name, price.part, price.chart): price for price in results.prices}
    shown = {
        figure: label for figure, label in FIGURES_OF_PARTS.items()
        if any(getattr(price, figure) is not None for price in results.prices)
    }  # fmt: skip

    def cells(name: str, part: str) -> Iterator[str]:
        for figure in shown:
            for chart in charts:
                price = found.get((name, part, chart))
                value = None if price is None else getattr(price, figure)
                yield number(value, 1 if figure == "instructions" else 0, sign=True)

    columns = tuple(f"{label} {chart}" for label in shown.values() for chart in charts)
    rows = tuple((name, part, *cells(name, part)) for name, part in parts)
    return Sheet(
        "C, what parts cost: bytes of code and RAM, instructions an event",
        ("machine", "part", *columns), rows,
    )  # fmt: skip


def speeds(results: Results) -> Sheet:
    """Return the table of machines in Python."""
    columns = ("chart", "machine", "events/s", "x match/case", "aim", "events", "digests")
    rows = tuple(
        (
            speed.chart,
            speed.name,
            number(speed.events_per_second),
            number(speed.ratio, 4),
            _reached(speed.ratio, AIMS[speed.chart].python) if speed.kind == FSMKIT else "",
            number(speed.events),
            ("equal" if speed.is_correct else "WRONG") + (f", {speed.note}" if speed.note else ""),
        )
        for speed in results.speeds
    )
    return Sheet(
        "Python: events a second; the ratio is the median of interleaved runs", columns, rows
    )


def _reached(value: float | None, aim: float) -> str:
    return str(aim) if value is None else f"{aim} {'met' if value >= aim else 'missed'}"


def evaluated(machine: Machine, value: float | None, aim: float) -> str:
    """Return an upper aim of generated machines with whether it is met; empty for others."""
    if machine.kind != FSMKIT:
        return ""
    return number(aim) if value is None else f"{number(aim)} {'met' if value <= aim else 'missed'}"


def number(value: float | None, digits: int = 0, *, sign: bool = False) -> str:
    """Return a number with its thousands apart; a dash for none."""
    if value is None:
        return MISSING
    return f"{value:{'+' if sign else ''},.{digits}f}"


def show(results: Results, console: Console) -> None:
    """Print the tables and the skipped measurements."""
    for sheet in sheets(results):
        table = Table(title=sheet.title, title_justify="left", box=SIMPLE_HEAD, pad_edge=False)
        for at, column in enumerate(sheet.columns):
            is_text = at < 2 or column in ("part", "digests")
            table.add_column(column, justify="left" if is_text else "right", no_wrap=True)
        for at, row in enumerate(sheet.rows):
            if at in sheet.groups:
                table.add_section()
            table.add_row(*row)
        console.print(table)
    for note in results.notes:
        console.print(f"skipped: {note}", markup=False)


def markdown(results: Results) -> str:
    """Return the run as a page of Markdown."""
    lines = [f"# {results.date}, {results.machine}", ""]
    lines += [f"* {name}: {text}" for name, text in results.tools.items() if text]
    for sheet in sheets(results):
        lines += ["", f"## {sheet.title}", "", _row(sheet.columns)]
        lines.append(_row(["---" if at < 2 else "---:" for at in range(len(sheet.columns))]))
        lines += [_row(row) for row in sheet.rows]
    if results.notes:
        lines += ["", "Skipped:", "", *(f"* {note}" for note in results.notes)]
    return "\n".join(lines) + "\n"


def _row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
