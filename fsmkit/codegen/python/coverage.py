"""The part `coverage` of a generated class: coverage counters (`plan.counting`)."""

from __future__ import annotations

from fsmkit.chart.chart import Chart
from fsmkit.codegen.python.family import Member
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.python.linking import LINK, ME
from fsmkit.diagnostics import fail
from fsmkit.plan.counting import FULL, area_of
from fsmkit.plan.fingerprint import fingerprint

OFFERED = "coverage"
"""The method that returns the counters."""


def require_names(member: Member) -> None:
    """Reject a chart whose class has an item with the name of the part's method."""
    names = member.names
    if OFFERED in (*names.variables.values(), *names.operations.values()):
        raise fail(
            "wrong-option", f"`{member.chart.name}` has an item `coverage`, the name of a method "
            "of the part `coverage`",
            help="rename the item `coverage` of the chart",
        )  # fmt: skip
    for inner in member.invoked:
        require_names(inner)


def area_name(member: Member) -> str:
    """Return the module variable that holds the counters of a class."""
    return f"_counters_{member.names.machine}"


def area_text(member: Member) -> str:
    """Return the definition of this variable."""
    return f"{area_name(member)} = bytearray({area_of(member.chart).size})"


def print_counting(out: Lines, member: Member) -> None:
    """Print the methods that count; all instances of a class share the counters."""
    area = area_name(member)
    full = f"if {area}[counter] < {FULL}:"
    with out.method("_count", "Count something once more.", "counter: int"), out.suite(full):
        out.line(f"{area}[counter] += 1")
    first = area_of(member.chart).first_transition
    with out.method("_count_taken", "Count a transition.", "transition: int"):
        out.line(f"{ME}_count({first} + transition)")
    passed = "value: bool, added: int, bit: int = -1"
    with out.method("_watched", "Note the value of a condition of a guard.", passed, "bool"):
        with out.suite("if bit >= 0:"):
            out.line(f"{ME}_noted |= 1 << bit + bool(value)")
        with out.suite("elif not value:"):
            out.line(f"{ME}_way += added")
        out.line("return value")
    passed = "value: bool, added: int, bit: int = -1"
    with out.method("_began", "Note the value of the first one.", passed, "bool"):
        out.line(f"{ME}_forget_way()  # of a guard that could not be evaluated")
        out.line(f"return {ME}_watched(value, added, bit)")
    passed = "value: bool, counter: int, noted: int = 0"
    with out.method("_decided", "Count the value of a guard, and the way to it.", passed, "bool"):
        out.line(f"{ME}_count(counter + (bool(value) if noted else {ME}_way))")
        with out.suite("for place in range(noted):"):
            out.line(f"{area}[counter + 2 + place] |= {ME}_noted >> 8 * place & 255")
        out.line("return value")
    with out.method("_forget_way", "Forget the conditions of the previous guard."):
        out.line(f"{ME}_way = {ME}_noted = 0")
    _print_access(out, member.chart, area, is_holding=bool(member.invoked))


def _print_access(out: Lines, chart: Chart, area: str, *, is_holding: bool) -> None:
    doc = "Return what tests reached of all machines of this class, for `fsmkit coverage --add`."
    number = bytes.fromhex(fingerprint(chart)[:16])
    with out.method(OFFERED, doc, result="bytes"):
        out.line(f"data = {b'FSMC' + bytes([1]) + number!r}")
        out.line(f"data += len({area}).to_bytes(4, 'little') + {area}")
        out.line(f"data += {LINK}binascii.crc_hqx(data, 0xFFFF).to_bytes(2, 'big')")
        if is_holding:
            with out.suite(f"for child in {ME}_children:"):
                out.line("data += child.coverage()")
        out.line("return data")
