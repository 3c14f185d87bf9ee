"""``python -m benchmarks.overhead``: measure, print, and put the table in its page."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.comparison.tools import UnavailableError, version
from benchmarks.overhead.measure import Figures, Meter
from benchmarks.overhead.parts import CALLS, PARTS, Call, Part

PAGE = Path(__file__).resolve().parents[2] / "docs" / "reference" / "benchmarks.md"
BEGIN = "<!-- python -m benchmarks.overhead --write -->\n"
END = "<!-- end -->\n"


@dataclass(frozen=True, slots=True)
class Price:
    """The cost of a part where it is used, and where it is not."""

    part: Part
    used: Figures
    unused: Figures | None
    """None: it is in every machine that is not made without it."""


def priced(part: Part, meter: Meter) -> Price:
    """Measure a part; `UnavailableError` if a tool is missing."""
    unused = None if part.unused is None else meter.difference(*part.unused())
    return Price(part, meter.difference(*part.used()), unused)


def called(call: Call, meter: Meter) -> float:
    """Return the instructions of a call."""
    return meter.difference(call.with_it(), call.without_it()).instructions


def table(prices: Sequence[Price], calls: Sequence[tuple[Call, float]]) -> str:
    """Return both tables as Markdown."""
    lines = [
        "| part | code | RAM | instr/event | of an event | unused: code, RAM, instr/event |",
        "|---|---|---|---|---|---|",
    ]
    for price in prices:
        used, unused = price.used, price.unused
        rest = f"{unused.code}, {unused.ram}, {unused.instructions:g}" if unused else ""
        rest = "; ".join(filter(None, (rest, price.part.remark)))
        lines.append(
            f"| {price.part.name} | {used.code} | {used.ram} | {used.instructions:.1f} "
            f"| {price.part.event} | {rest} |"
        )
    lines += ["", "| call | instructions |", "|---|---|"]
    lines += [f"| {call.name} | {count:.0f} |" for call, count in calls]
    return "\n".join(lines) + "\n"


def placed(page: str, text: str) -> str:
    """Return a page with a text between its marks."""
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}{text}{END}{after}"


def main(words: list[str] | None = None) -> int:
    """Measure and print; 2 if a tool is missing."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.overhead")
    parser.add_argument("--write", action="store_true", help=f"put the table in {PAGE.name}")
    options = parser.parse_args(words)
    with TemporaryDirectory(prefix="fsmkit-") as folder:
        work = Path(folder)
        meter = Meter(work)
        try:
            prices = [priced(part, meter) for part in PARTS]
            calls = [(call, called(call, meter)) for call in CALLS]
        except UnavailableError as error:
            sys.stderr.write(f"{error}\n")
            return 2
        tools = ", ".join(version(tool, work) for tool in ("arm-none-eabi-gcc", "gcc"))
    text = f"{table(prices, calls)}\n{tools}.\n"
    sys.stdout.write(text)
    if options.write:
        PAGE.write_text(placed(PAGE.read_text(encoding="utf-8"), text), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
