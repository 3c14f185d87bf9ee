"""Names of a chart as names of Python: valid, different from each other, and from the machine's."""

from __future__ import annotations

import keyword
import sys
from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass

from fsmkit.chart.chart import Chart
from fsmkit.codegen.python.template import machine as template
from fsmkit.document.document import Trigger
from fsmkit.emit import snake
from fsmkit.emit.identifiers import legal
from fsmkit.language import EnumType

OFFERED = frozenset({"save", "restore"})
"""Methods of machines that are made so."""


@dataclass(frozen=True, slots=True)
class Names:
    """What the generated text calls the parts of a chart. Tuples go by index."""

    machine: str
    states: tuple[str, ...]
    """Constants with the bit of a state; a state ``idle`` is ``S_IDLE``."""
    bare: tuple[str, ...]
    """What names of methods say for a state."""
    events: tuple[str, ...]
    """Suffixes of methods: an event ``group.go`` is posted by ``post_group_go``."""
    types: tuple[str, ...]
    """What ``_event.type`` is of each event."""
    transitions: tuple[str, ...]
    """Suffixes of methods that tell source and number."""
    variables: dict[str, str]
    operations: dict[str, str]
    timers: dict[int, str]
    """Constants of the transitions that time takes: ``T_IDLE``, of several ``T_IDLE_1`` ..."""


def names_of(chart: Chart, hidden: Collection[str] = (), prefix: str | None = None) -> Names:
    """Return the names for a chart. A clash is resolved by underscores at the end.

    ``hidden``: what operations cannot be called, because a machine around it is called so.
    ``prefix`` names the machine instead of the chart.
    """
    machine = name_of_class(prefix or chart.name)
    events = distinct([identifier(event.name) for event in chart.events])
    methods = [f"{verb}_{event}" for event in events for verb in ("post", "dispatch", "send")]
    taken = template().names | OFFERED | set(methods)
    variables = [v.name for group in (chart.data, chart.inputs, chart.outputs) for v in group]
    attributes = distinct([_public(name) for name in variables], taken)
    states = distinct([identifier(state.id) for state in chart.states])
    operations = [operation.name for operation in chart.operations]
    # methods of a subclass: they must not hide what the machine has
    own = distinct(map(_public, operations), taken | {*attributes, *hidden})
    return Names(
        machine=machine,
        states=("ROOT", *constants("S", states[1:])),
        bare=states,
        events=events,
        types=tuple(event.type for event in chart.events),
        transitions=tuple(f"{states[t.source]}_{t.index}" for t in chart.transitions),
        variables=dict(zip(variables, attributes, strict=True)),
        operations=dict(zip(operations, own, strict=True)),
        timers=timers_of(chart, "T", states),
    )


def constants(prefix: str, names: Iterable[str]) -> tuple[str, ...]:
    """Return names of constants, in capitals and different from each other."""
    return distinct(f"{prefix}_{name.upper()}" for name in names)


def timers_of(chart: Chart, prefix: str, states: tuple[str, ...]) -> dict[int, str]:
    """Return names for the transitions that time takes: of their state, counted if several."""
    timed = [t for t in chart.transitions if t.trigger in (Trigger.AFTER, Trigger.EVERY)]
    count = Counter(t.source for t in timed)
    seen: Counter[int] = Counter()
    wanted = []
    for transition in timed:
        seen[transition.source] += 1
        several = count[transition.source] > 1
        number = f"_{seen[transition.source]}" if several else ""
        wanted.append(f"{states[transition.source]}{number}")
    return dict(zip((t.index for t in timed), constants(prefix, wanted), strict=True))


def identifier(name: str) -> str:
    """Return a name with everything replaced that Python does not allow in one."""
    text = legal(name)
    return f"{text}_" if keyword.iskeyword(text) else text


def name_of_class(name: str) -> str:
    """Return a name of a class: no two underscores begin it, which its body would mangle."""
    text = identifier(name)
    text = f"v{text}" if text.startswith("__") else text
    return text[:1].upper() + text[1:]


def _public(name: str) -> str:
    text = identifier(name)
    return f"v{text}" if text.startswith("_") else text


def members_of(type_: EnumType) -> tuple[str, ...]:
    """Return the names of the members, of which `IntEnum` takes none for its own."""
    return distinct(map(_public, type_.members), {"mro", "name", "value"})


def distinct(names: Iterable[str], taken: Collection[str] = ()) -> tuple[str, ...]:
    """Return names that differ from each other and from those taken, with underscores added."""
    found: dict[str, None] = {}
    for name in names:
        text = name
        while text in taken or text in found:
            text += "_"
        found[text] = None
    return tuple(found)


def file_name(chart: Chart, prefix: str | None = None) -> str:
    """Return the name of the module: ``feeder.py``; none that hides a module or is a keyword."""
    name = snake(prefix or chart.name)
    is_taken = keyword.iskeyword(name) or name in sys.stdlib_module_names
    return f"{name}_machine.py" if is_taken else f"{name}.py"
