"""Names of a chart as Python names: valid, distinct, and different from the machine's."""

from __future__ import annotations

import keyword
import sys
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field

from fsmkit.chart.chart import Chart, Event
from fsmkit.chart.content import local_names
from fsmkit.codegen.python.linking import LINK
from fsmkit.codegen.python.template import machine as template
from fsmkit.document.document import Direction
from fsmkit.emit import Namer, legal, snake
from fsmkit.language import EnumType, Type, Value

OFFERED = frozenset({"save", "restore"})
"""The methods of machines that hosts may call and that are generated."""
RESERVED = (
    *("CLOCK", "FAR", "NOTHING", "ROOT", "Any", "Callable", "ClassVar", "IntEnum", "Iterator"),
    *("Protocol", "ContentError", "EndOfBlock", "RangeFault"),
)
"""The names of every module that constants and enumerations could have."""


class Module(Namer):
    """Names the items of a module; all its machines share the enumerations."""

    def __init__(self, reserved: Iterable[str]) -> None:
        """Start with names that are already taken."""
        super().__init__((*RESERVED, *reserved))
        self.enumerations: dict[EnumType, str] = {}
        self.members: dict[tuple[EnumType, Value], str] = {}
        self._hosted: dict[str, object] = {}

    def of_events(self, events: Iterable[Event], path: str) -> tuple[str, ...]:
        """Return the suffixes of the event methods of a machine in the slots ``path``.

        An outgoing event is a method of the host, with a name and a payload.
        """
        events = tuple(events)
        found = []
        for event, name in zip(events, distinct(identifier(e.name) for e in events), strict=True):
            text = name
            if Direction.OUT in event.directions:
                payload = (len(event.directions) > 1, *(part.type for part in event.fields))
                text = self._of_host("send_", name, (event.name, payload), path)
            found.append(text)
        return distinct(found)

    def of_operations(
        self, operations: Iterable[str], methods: Iterable[str], path: str
    ) -> tuple[str, ...]:
        """Return the methods of the host that perform the operations of a machine."""
        pairs = zip(operations, methods, strict=True)
        return tuple(self._of_host("", method, operation, path) for operation, method in pairs)

    def _of_host(self, verb: str, name: str, owner: object, path: str) -> str:
        """Return a name for which the host has one method in all machines of the module.

        If an earlier machine uses it for another item, the ``path`` is prepended. The outermost
        machine, whose path is empty, comes first, and its names are distinct.
        """
        while self._hosted.setdefault(f"{verb}{name}", owner) != owner and path:
            name = f"{path}{name}"
        return name

    def add(self, type_: EnumType) -> None:
        """Name an enumeration and its members, unless an earlier machine has it."""
        if type_ not in self.enumerations:
            self.enumerations[type_] = self.name(identifier(type_.name))
            for member, number in zip(type_.members, type_.numbers, strict=True):
                name = _constant(f"{snake(type_.name)}_{legal(member)}")
                self.members[type_, number] = LINK + self.name(name)

    def of_state(self, name: str) -> str:
        """Return the constant of a state, free for its configuration with another first letter."""
        while True:
            bit = self.name(f"S_{name}".upper())
            if self.name(f"C{bit[1:]}") == f"C{bit[1:]}":
                return bit


@dataclass(frozen=True, slots=True)
class Names:
    """The generated names of the parts of a chart. Tuples are by index."""

    machine: str
    states: tuple[str, ...]
    """Constants with the bit of a state; a state ``idle`` is ``S_IDLE``."""
    bare: tuple[str, ...]
    """The part of method names that identifies a state."""
    events: tuple[str, ...]
    """Suffixes of methods: an event ``group.go`` is posted by ``post_group_go``."""
    types: tuple[str, ...]
    """The value of ``_event.type`` for each event."""
    transitions: tuple[str, ...]
    """Suffixes of methods, with source and number of the transition."""
    variables: dict[str, str]
    operations: dict[str, str]
    functions: dict[str, str] = field(default_factory=dict)
    """The methods for the functions of the chart."""
    locals: dict[str, str] = field(default_factory=dict)
    """Attributes that hold the local variables of content."""
    timers: dict[int, str] = field(default_factory=dict)
    """Constants of timed transitions: ``TIMER_IDLE_T_MOVE``, ``TIMER_IDLE_AFTER``."""
    constants: dict[tuple[str, str], str] = field(default_factory=dict)
    """Constants of the chart, by `_key`."""
    enumerations: dict[EnumType, str] = field(default_factory=dict)
    members: dict[tuple[EnumType, Value], str] = field(default_factory=dict)
    """Constants of the members of enumerations, by number."""
    guards: dict[tuple[int, object], str] = field(default_factory=dict, compare=False, repr=False)
    """The texts of guards, by form and current payload; each is printed once."""

    def constant(self, name: str | None, value: Value, type_: Type | None) -> str | None:
        """Return the name of a value, or None if it has none.

        ``name``: the constant of the chart in the source.
        """
        if isinstance(type_, EnumType):
            return self.members.get((type_, value))
        return None if name is None else self.constants.get(_key(name, value, type_))


def _key(name: str, value: Value, type_: Type | None) -> tuple[str, str]:
    """Return the key of a constant: folding can give its name to another value."""
    return name, f"{type(type_).__name__} {value!r}"


def names_of(
    chart: Chart, module: Module, machine: str, path: str = "", hidden: Collection[str] = ()
) -> Names:
    """Return the names for a chart. Clashing names get a suffix.

    ``module``: names of the module; ``path``: the prefix for constants of a machine in a slot;
    ``hidden``: names that operations cannot have, because a surrounding machine has them.
    """
    events = module.of_events(chart.events, path)
    methods = [f"{verb}_{event}" for event in events for verb in ("post", "dispatch", "send")]
    taken = template().names | OFFERED | set(methods)
    variables = [v.name for group in (chart.data, chart.inputs, chart.outputs) for v in group]
    attributes = distinct([_public(name) for name in variables], taken)
    states = distinct([identifier(state.id) for state in chart.states])
    operations = [operation.name for operation in chart.operations]
    for type_ in chart.types:
        if isinstance(type_, EnumType):
            module.add(type_)
    # methods of a subclass: they must not hide what the machine has
    own = distinct(map(_public, operations), taken | {*attributes, *hidden})
    own = module.of_operations(operations, own, path)
    return Names(
        machine=machine,
        states=(
            f"{LINK}ROOT",
            *(LINK + module.of_state(f"{path}{state}") for state in states[1:]),
        ),
        bare=states,
        events=events,
        types=tuple(event.type for event in chart.events),
        transitions=tuple(f"{states[t.source]}_{t.index}" for t in chart.transitions),
        variables=dict(zip(variables, attributes, strict=True)),
        operations=dict(zip(operations, own, strict=True)),
        functions={f.name: f"_fn_{n}_{legal(f.name)}" for n, f in enumerate(chart.functions)},
        locals={name: f"_let_{n}_{legal(name)}" for n, name in enumerate(local_names(chart))},
        timers={
            t.index: LINK
            + module.name(
                f"TIMER_{path}{states[t.source]}_{legal(t.delay_name or t.trigger.value)}".upper()
            )
            for t in chart.transitions
            if t.has_timer
        },
        constants={
            _key(name, literal.value, literal.type): LINK
            + module.name(_constant(f"{path}{legal(name)}"))
            for name, literal in chart.constants
        },
        enumerations=module.enumerations,
        members=module.members,
    )


def _constant(name: str) -> str:
    """Return a name in capitals without two leading underscores, which a class would mangle."""
    text = identifier(name).upper()
    return f"V{text}" if text.startswith("__") else text


def identifier(name: str) -> str:
    """Return a valid identifier: every character that Python does not allow is replaced."""
    text = legal(name)
    return f"{text}_" if keyword.iskeyword(text) else text


def name_of_class(name: str) -> str:
    """Return a class name without two leading underscores, which its body would mangle.

    A capital can turn a name into a keyword: the chart `true` would become `True`.
    """
    text = legal(name)
    text = f"v{text}" if text.startswith("__") else text
    return identifier(text[:1].upper() + text[1:])


def _public(name: str) -> str:
    text = identifier(name)
    return f"v{text}" if text.startswith("_") else text


def members_of(type_: EnumType) -> tuple[str, ...]:
    """Return the names of the members, except those that `IntEnum` reserves."""
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
    """Return the file name of the module: ``feeder.py``; it hides no module and is no keyword."""
    name = snake(prefix or chart.name)
    is_taken = keyword.iskeyword(name) or name in sys.stdlib_module_names
    return f"{name}_machine.py" if is_taken else f"{name}.py"
