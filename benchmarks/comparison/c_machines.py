"""A chart in C, by fsmkit or by hand, and the page that defines its names for the driver.

Names and prototypes are read from the machine's header, so that the bench follows the generator.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from benchmarks.comparison.tools import UnavailableError
from benchmarks.yardstick.charts import FOLDER
from benchmarks.yardstick.streams import Stream
from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.codegen.target import Target
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.plugins import plugin

BY_HAND = FOLDER / "by_hand"
VERBS = ("init", "start", "dispatch")
"""The functions that the driver calls; `init` of a hand-written machine also starts it."""

_COUNTER = re.compile(r"^c(\d+)$")
_SWITCH = re.compile(r"#\s*(?:ifn?def|(?:el)?if\b.*?\bdefined\s*\(?)\s*(FSM_NO_\w+)")


@dataclass(frozen=True, slots=True)
class Variant:
    """A configuration of a machine: options of the target, macros of the compiler."""

    name: str
    options: Mapping[str, str] = field(default_factory=dict)
    macros: tuple[str, ...] = ()


VARIANTS = (
    Variant("fsmkit", {}, ("FSM_NO_NAMES",)),
    Variant("fsmkit, no counters", {"without": "counters"}, ("FSM_NO_NAMES",)),
    Variant("fsmkit, no queue", {"without": "queue,counters"}, ("FSM_NO_NAMES",)),
    Variant(
        "fsmkit, size",
        {"without": "queue,counters", "optimize": "size"},
        ("FSM_NO_NAMES",),
    ),
)
"""The first is what is written without any option; a later one with equal text is skipped."""


@dataclass(frozen=True, slots=True)
class Machine:
    """The C of a chart, and its header's names."""

    variant: Variant
    files: Mapping[str, str]
    prefix: str

    @property
    def header(self) -> str:
        """The text of the machine's header."""
        return self.files[f"{self.prefix}.h"]

    def write(self, folder: Path) -> None:
        """Write the files to a folder."""
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in self.files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(text, encoding="utf-8")

    def sources(self) -> list[str]:
        """Return the files to compile."""
        return sorted(name for name in self.files if name.endswith(".c"))


def generate(chart: Chart, variant: Variant) -> Machine:
    """Return the machine of a chart; `UnavailableError` if the target rejects the options."""
    prefix = f"bench_{chart.name.lower()}"
    findings = Findings()
    try:
        options = {"prefix": prefix, **variant.options}
        made = plugin(Target, "c").generate(chart, findings, options)
    except FsmkitError as error:
        raise UnavailableError(f"{variant.name}: {error}") from None
    if made is None or findings.has_errors:
        said = "; ".join(finding.message for finding in findings)
        raise UnavailableError(f"{variant.name}: {said}")
    return Machine(variant, made.files, prefix)


def different(machines: list[Machine]) -> tuple[list[Machine], list[str]]:
    """Return the machines with a new source, and the names of the others with their equals."""
    kept: list[Machine] = []
    same: list[str] = []
    for machine in machines:
        equal = [
            other for other in kept
            if (other.files, other.variant.macros) == (machine.files, machine.variant.macros)
        ]  # fmt: skip
        if equal:
            same.append(f"`{machine.variant.name}` is `{equal[0].variant.name}`")
        else:
            kept.append(machine)
    return kept, same


def chart_of(path: Path) -> Chart:
    """Return the chart of a file; `UnavailableError` if it has an error."""
    try:
        return load(path)
    except FsmkitError as error:
        raise UnavailableError(f"{path}: {error}") from None


def machines(path: Path, variants: tuple[Variant, ...]) -> tuple[list[Machine], list[str]]:
    """Return the different machines of a chart, and notes on the skipped variants."""
    chart = chart_of(path)
    made: list[Machine] = []
    notes: list[str] = []
    for variant in variants:
        try:
            made.append(generate(chart, variant))
        except UnavailableError as error:
            notes.append(str(error))
    kept, same = different(made)
    return kept, notes + same


def by_hand(letter: str) -> list[Machine]:
    """Return the hand-written machines for a chart; a variant is named after the source file."""
    prefix = f"chart_{letter.lower()}"
    headers = {path.name: path.read_text(encoding="utf-8") for path in BY_HAND.glob("*.h")}
    return [
        Machine(
            Variant(path.stem.removeprefix(f"{prefix}_")),
            {**headers, path.name: path.read_text(encoding="utf-8")},
            prefix,
        )
        for path in sorted(BY_HAND.glob(f"{prefix}_*.c"))
    ]


def switches(machine: Machine) -> list[str]:
    """Return the macros, of those that leave something out, that the variant does not define."""
    found = {name for text in machine.files.values() for name in _SWITCH.findall(text)}
    return sorted(found - set(machine.variant.macros))


def without(machine: Machine, macro: str) -> Machine:
    """Return a machine that is compiled with one more macro."""
    variant = replace(machine.variant, macros=(*machine.variant.macros, macro))
    return replace(machine, variant=variant)


def enumerators(machine: Machine, kind: str) -> dict[str, int]:
    """Return the numbers of all states or events by their names in the header: ``STATE_IDLE``."""
    head = f"{machine.prefix}_{kind}_".upper()
    found = re.findall(rf"\b{head}(\w+)\s*=\s*(\d+)u?\b", machine.header)
    return {name: int(number) for name, number in found}


def prototype(machine: Machine, verb: str) -> tuple[str, str]:
    """Return the type of the result and the parameters of one function of the machine."""
    pattern = rf"^([\w ]+?)\s*\b{machine.prefix}_{verb}\(([^)]*)\);"
    found = re.search(pattern, machine.header, re.MULTILINE)
    if found is None:
        raise UnavailableError(f"{machine.prefix}.h offers no function {machine.prefix}_{verb}")
    return found[1], found[2]


def verbs(machine: Machine) -> list[str]:
    """Return which of `VERBS` the machine has."""
    return [verb for verb in VERBS if f"{machine.prefix}_{verb}(" in machine.header]


def members(machine: Machine, stream: Stream) -> list[str]:
    """Return the member of each variable; a hand-written machine has an array of counters."""
    if "c[" not in machine.header:
        return list(stream.variables)
    return [_COUNTER.sub(r"c[\1]", name) for name in stream.variables]


def call(machine: Machine, verb: str) -> str:
    """Return a call of a function of the machine, in C, with the event ``events[i]``."""
    _, parameters = prototype(machine, verb)
    arguments = (_argument(machine, text.strip()) for text in parameters.split(","))
    return f"{machine.prefix}_{verb}({', '.join(arguments)})"


def _argument(machine: Machine, parameter: str) -> str:
    """Return the argument of the driver; time does not advance."""
    type_ = re.sub(r"\bconst\b|\w+$", "", parameter).replace(" ", "")
    known = {
        f"{machine.prefix}*": "&machine",
        f"{machine.prefix}_event*": "&events[i]",
        f"{machine.prefix}_event": "events[i]",
    }
    if type_ in known:
        return known[type_]
    if parameter.endswith("now"):
        return "0"
    raise UnavailableError(f"{machine.prefix}.h: the bench cannot pass `{parameter}`")


def event_numbers(machine: Machine, stream: Stream) -> list[int]:
    """Return the machine's number of each event of a stream."""
    known = enumerators(machine, "event")
    missing = [name for name in stream.names if name.upper() not in known]
    if missing:
        raise UnavailableError(f"{machine.prefix}.h knows no event {missing[0]}")
    return [known[name.upper()] for name in stream.names]


def state_codes(machine: Machine, stream: Stream) -> list[int]:
    """Return, at each state number of the machine, the yardstick's plus one; 0 if not counted."""
    known = enumerators(machine, "state")
    wanted = {known.get(name.upper(), -1): code + 1 for code, name in enumerate(stream.states)}
    return [
        wanted[number] if number in wanted and stream.states[wanted[number] - 1] else 0
        for number in range(max(known.values(), default=0) + 1)
    ]


def driver_page(machine: Machine, stream: Stream) -> str:
    """Return ``bench_chart.h``: the machine's names for the driver."""
    data = [f"(uint32_t)machine.data.{member}" for member in members(machine, stream)]
    is_number = "events[i]" in call(machine, "dispatch").replace("&events[i]", "")
    lines = [
        "#ifndef BENCH_CHART_H",
        "#define BENCH_CHART_H",
        "#include <stdint.h>",
        "#ifdef BENCH_VERIFY",
        "void bench_entered(unsigned state);",
        "void bench_exited(unsigned state);",
        "#define FSM_HOOK_ENTER(m, state) bench_entered((unsigned)(state))",
        "#define FSM_HOOK_EXIT(m, state) bench_exited((unsigned)(state))",
        "#endif",
        f'#include "{machine.prefix}.h"',
        f"#define BENCH_MACHINE {machine.prefix}",
        f"#define BENCH_EVENT {machine.prefix}_event",
        f"#define BENCH_SET(e, number) ((e){'' if is_number else '.event'} = (number))",
        f"#define BENCH_NUMBERS {_list(event_numbers(machine, stream))}",
        f"#define BENCH_CODES {_list(state_codes(machine, stream))}",
        f"#define BENCH_INIT {call(machine, 'init')}",
        f"#define BENCH_START {call(machine, 'start') if 'start' in verbs(machine) else '(void)0'}",
        f"#define BENCH_DISPATCH(i) {call(machine, 'dispatch')}",
        f"#define BENCH_DATA {', '.join(data)}",
        "#endif",
    ]
    return "\n".join(lines) + "\n"


def empty_machine(machine: Machine) -> str:
    """Return a machine with the same functions that does nothing: the price of the loop.

    Its results are never used, so that none is given (C99 6.9.1, 12).
    """
    lines = ['#include "bench_chart.h"']
    for verb in verbs(machine):
        result, parameters = prototype(machine, verb)
        names = [text.split()[-1].lstrip("*") for text in parameters.split(",")]
        ignored = " ".join(f"(void){name};" for name in names)
        lines.append(f"{result} {machine.prefix}_{verb}({parameters}) {{ {ignored} }}")
    return "\n".join(lines) + "\n"


def size_page(machine: Machine, stream: Stream) -> str:
    """Return a file whose sections are as large as the struct and as the user's variables in it.

    One byte more each, for a section of none would not be there.
    """
    user = " + ".join(
        f"sizeof ((BENCH_MACHINE *)0)->data.{member}" for member in members(machine, stream)
    )
    return (
        '#include "bench_chart.h"\n'
        "#define IN(name) __attribute__((section(name)))\n"
        'const char bench_ram[1 + sizeof(BENCH_MACHINE)] IN(".bench_ram") = {0};\n'
        f'const char bench_user[1 + {user}] IN(".bench_user") = {{0}};\n'
    )


def _list(numbers: list[int]) -> str:
    return ", ".join(map(str, numbers))
