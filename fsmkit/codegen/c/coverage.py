"""The part `coverage` of a machine in C: coverage counters.

`plan.counting` defines the counters. Private names start with ``fsm_``, so that the part changes no
name of the chart.
"""

from __future__ import annotations

from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.names import Names
from fsmkit.diagnostics import fail
from fsmkit.emit import Emitter
from fsmkit.plan.counting import FULL, Area, area_of
from fsmkit.plan.fingerprint import fingerprint

PART = "coverage"
DIGITS = 16
"""The digits of the fingerprint, in the format of `coverage`."""


def is_counted(names: Names) -> bool:
    """Whether a machine counts coverage."""
    return PART in names.options.extras


def require_names(names: Names) -> None:
    """Reject a chart whose own names clash with those of the part (``c-limit``)."""
    taken = {*names.operations.values(), *names.enumerations.values(), *names.records.values()}
    macros = {*names.constants.values(), *(m for group in names.members.values() for m in group)}
    if taken & {PART, f"{names.prefix}_{PART}"} or f"{names.upper}_COVERAGE_BYTES" in macros:
        raise fail(
            "c-limit", f"`{names.chart.name}` has a name that is equal in C to one of the "
            "part `coverage`",
            help="rename the item `coverage` or `COVERAGE_BYTES` of the chart",
        )  # fmt: skip
    for inner in names.invoked:
        require_names(inner)


def print_declarations(out: Emitter, names: Names) -> None:
    """Print the declarations of the counters for the header."""
    p = names.prefix
    out.text(f"""
    /* Coverage counters for `fsmkit coverage --add`, in one area of RAM for all
     * machines of this type. The first function writes it, then those of machines in slots;
     * the second clears them. See fsm_coverage.h. */
    #define {names.upper}_COVERAGE_BYTES {area_of(names.chart).size}u
    void {p}_coverage(fsm_write write, void *arg);
    void {p}_coverage_clear(void);
    """)
    out.line()


def print_counters(out: Unit, names: Names) -> None:
    """Print the counters, and the functions that count."""
    own, upper, area = f"fsm_{names.own}", f"FSM_{names.own_upper}", area_of(names.chart)
    out.define(None)
    out.line("/* By state, by transition, by way through a guard. */")
    out.line(f"static uint8_t {own}_counters[{area.size}];")
    out.line()
    out.define("count")
    out.line(f"static inline void {own}_count(size_t counter)")
    with out.block("{"):
        out.lines(
            [f"if ({own}_counters[counter] != {FULL}u) {{", f"    {own}_counters[counter]++;"]
        )
        out.line("}")
    out.line()
    for hook, first in (("TAKE", area.first_transition), ("ENTER", 0)):
        place = f"(size_t)(number) + {first}u" if first else "(size_t)(number)"
        out.define(None)
        out.line(f"#define {upper}_{hook}(m, number) \\")
        out.line("    do { \\")
        # written out: an optimizer for size calls even so small a function
        out.line(f"        if ({own}_counters[{place}] != {FULL}u) {{ \\")
        out.line(f"            {own}_counters[{place}]++; \\")
        out.line("        } \\")
        out.line(f"        FSM_HOOK_{hook}(m, number); \\")
        out.line("    } while (0)")
        out.line()
    _print_guards(out, names, area)


def _print_guards(out: Unit, names: Names, area: Area) -> None:
    own = f"fsm_{names.own}"
    out.define("went")
    out.line(f"static inline bool {own}_went(const uint8_t *failed, size_t way, bool value)")
    with out.block("{"):
        out.lines(["if (*failed == FSM_FINE) {", f"    {own}_counters[way] = 1u;", "}"])
        out.line("return value;")
    out.line()
    if not area.noted:
        out.define(None)
        return
    out.define("noted")
    out.line(f"static uint8_t {own}_noted[{area.noted}]; /* of the guard that is evaluated */")
    out.line()
    out.define("note")
    out.line(f"static bool {own}_note(bool value, uint32_t bit)")
    with out.block("{"):
        out.line("uint32_t own = bit + (value ? 1u : 0u);")
        at = f"{own}_noted[own / 8u]"
        out.line(f"{at} = (uint8_t)({at} | (uint8_t)(1u << (own % 8u)));")
        out.line("return value;")
    out.line()
    out.define("decided_many")
    passed = "bool value, const uint8_t *failed, size_t counter, size_t count"
    out.line(f"static bool {own}_decided_many({passed})")
    with out.block("{"):
        out.line("bool fine = failed == NULL || *failed == FSM_FINE;")
        out.lines(["if (fine) {", f"    {own}_count(counter + (value ? 1u : 0u));", "}"])
        with out.block("for (size_t i = 0u; i < count; i++) {"):
            at = f"{own}_counters[counter + 2u + i]"
            out.lines(["if (fine) {", f"    {at} = (uint8_t)({at} | {own}_noted[i]);", "}"])
            out.line(f"{own}_noted[i] = 0u;")
        out.line("return value;")
    out.line()
    out.define(None)


def print_access(out: Unit, names: Names) -> None:
    """Print the functions that report and clear the counters."""
    own, p = f"fsm_{names.own}", names.own
    digits = fingerprint(names.chart)[:DIGITS]
    number = ", ".join(f"0x{digits[at : at + 2].upper()}u" for at in range(0, DIGITS, 2))
    out.define(None)
    out.line(f"void {p}_coverage(fsm_write write, void *arg)")
    with out.block("{"):
        out.line(f"static const uint8_t fingerprint[8] = {{{number}}};")
        passed = f"fingerprint, {own}_counters, sizeof {own}_counters, write, arg"
        out.line(f"fsm_coverage_write({passed});")
        out.lines(f"{inside.prefix}_coverage(write, arg);" for inside in names.invoked)
    out.line()
    out.define(None)
    out.line(f"void {p}_coverage_clear(void)")
    with out.block("{"):
        with out.block(f"for (size_t i = 0u; i < sizeof {own}_counters; i++) {{"):
            out.line(f"{own}_counters[i] = 0u;")
        out.lines(f"{inside.prefix}_coverage_clear();" for inside in names.invoked)
    out.line()
