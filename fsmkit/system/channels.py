"""Model connections that buffer, delay or lose messages as machines between their two ends.

``{kind: queued, capacity: 4, delay: 5ms}``, ``{kind: lossy, capacity: 1, loss: 2}``. The machine
takes a message from its queue and forwards it after the delay, or loses it. Without a capacity and
a delay it forwards messages at once. With a capacity they wait in its queue while other machines
move, but not while time passes. Messages never overtake each other: all have the same delay, and in
untimed exploration only the oldest message may arrive next.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, Source, Span, Text
from fsmkit.document.keys import CONNECTION
from fsmkit.language import EnumType, Field, Scope, Type, read_duration
from fsmkit.system.indices import integer
from fsmkit.system.machine import EventLink, Machine, port_name
from fsmkit.system.system import System
from fsmkit.yaml.nodes import Node, check_keys, require_mapping, require_text
from fsmkit.yaml.reader import read_document

KINDS = ("direct", "queued", "lossy")
MOST = 255
"""Messages that a connection can hold, and lose."""
ANY = MOST + 1
"""Losses of a connection that may lose every message."""
CAPACITY = 8
"""Messages that a queued connection holds unless it says how many."""


@dataclass(frozen=True, slots=True)
class ChannelOptions:
    """How messages travel. ``capacity`` 0: at once; ``loss``: the maximum number lost, or `ANY`.

    ``priority``: on a bus that nodes share, 0 is the highest. It is not part of the model.
    """

    capacity: int = 0
    loss: int = 0
    delay: int = 0
    priority: int | None = None

    @property
    def is_direct(self) -> bool:
        """Whether messages are neither buffered, delayed nor lost."""
        return (self.capacity, self.loss, self.delay) == (0, 0, 0)


DIRECT = ChannelOptions()


def read_options(node: Node, tick: int, findings: Findings) -> ChannelOptions | None:
    """Read the options of a connection; ``tick`` is the unit of delays in microseconds."""
    mapping = require_mapping(node, "the options of a connection", findings)
    if mapping is None:
        return None
    check_keys(mapping, CONNECTION, "a connection", findings)
    texts: dict[str, Text] = {}
    for key, value in mapping.entries:
        if (text := require_text(value, f"`{key}`", findings)) is None:
            return None
        texts[key.value] = text
    priority = texts.pop("priority", None)
    rank = _count(priority, None, 0, findings)
    kind = texts.pop("kind", None)
    name = "direct" if kind is None else kind.value
    if name not in KINDS:
        findings.add(
            "unexpected-value",
            f"there is no connection of the kind `{kind}`",
            kind,
            help=f"use one of {', '.join(KINDS)}",
        )
        return None
    for option, given in texts.items():
        if name == "direct" or (name == "queued" and option == "loss"):
            findings.add(
                "unexpected-value",
                f"a connection of the kind `{name}` has no `{option}`",
                given,
                help="remove it, or say another kind",
            )
            return None
    capacity = _count(texts.get("capacity"), CAPACITY if name == "queued" else 0, 1, findings)
    lost = texts.get("loss")
    is_any = lost is not None and lost.value == "any"
    loss = ANY if is_any else _count(lost, 1 if name == "lossy" else 0, 0, findings)
    delay = 0
    if (late := texts.get("delay")) is not None:
        delay = read_duration(late, Scope(tick=tick), findings) or 0
        capacity = capacity or CAPACITY
    return ChannelOptions(capacity or 0, loss or 0, delay, rank)


def _count(text: Text | None, otherwise: int | None, least: int, findings: Findings) -> int | None:
    if text is None:
        return otherwise
    number = integer(text, findings)
    if number is None or least <= number <= MOST:
        return number
    findings.add("bad-capacity", f"this must be within {least}..{MOST}", text)
    return None


def channel(
    link: EventLink, options: ChannelOptions, machines: tuple[Machine, ...], number: int, span: Span
) -> tuple[Machine, EventLink, EventLink]:
    """Return the machine of a connection, with the index ``number``, and its two wires."""
    source, target = machines[link.source], machines[link.target]
    event = target.chart.events[link.event]
    name = f"{source.name}.{port_name(source.chart, link.port)}>{target.name}.{event.name}"
    chart = channel_chart(event.fields, options, target.chart.capacities.tick)
    is_passive = options.capacity == 0 or options.delay > 0
    machine = Machine(name, chart, environment=is_passive, span=span, is_channel=True)
    put, get = (chart.event_index[name] for name in ("put", "get"))
    enter = EventLink(link.source, link.port, number, put, link.arguments, link.priority)
    leave = EventLink(number, get, link.target, link.event, tuple(range(len(event.fields))))
    return machine, enter, leave


def channel_chart(fields: tuple[Field, ...], options: ChannelOptions, tick: int) -> Chart:
    """Return the chart that buffers, delays or loses messages with these fields."""
    return chart_of_text(_text(fields, options, tick))


def chart_of_text(text: str) -> Chart:
    """Return the chart of a built-in source text."""
    findings = Findings()
    document = read_document(Source("connection", text), findings)
    chart = None if document is None else elaborate((document,), findings)
    assert chart is not None, str(list(findings))  # noqa: S101  (written here)
    return chart


def types_text(types: Iterable[Type]) -> list[str]:
    """Return the lines that declare the enumerations among these types."""
    found = {type_.name: type_ for type_ in types if isinstance(type_, EnumType)}
    lines = [f"  {name}: [{_members(type_)}]" for name, type_ in found.items()]
    return ["types:", *lines] if lines else []


def _members(type_: EnumType) -> str:
    pairs = zip(type_.members, type_.numbers, strict=True)
    return ", ".join(m if type_.is_counted else f"{m} = {n}" for m, n in pairs)


def _text(fields: tuple[Field, ...], options: ChannelOptions, tick: int) -> str:
    shown = ", ".join(f"{part.name} {part.type}" for part in fields)
    values = ", ".join(f"{part.name} = event.{part.name}" for part in fields)
    later = f" after {options.delay * tick}us" if options.delay else ""
    lines = ["chart: Connection", *types_text(part.type for part in fields)]
    room = max(1, options.capacity)
    lines.append(f"capacity: {{queue: {room}, delayed: {room}, tick: {tick}us}}")
    lines.append(f'events: {{in: ["put({shown})"], out: ["get({shown})"]}}')
    if options.loss:
        lines.append('operations: ["loses() -> bool"]')
    if 0 < options.loss <= MOST:
        lines.append(f"data: {{lost: 0..{options.loss} = 0}}")
    lines += ["initial: open", "states:", "  open:", "    rest: true", "    on:", "      put:"]
    if options.loss == ANY:
        lines.append("        - {if: loses()}")
    elif options.loss:
        lines.append(f'        - {{if: "lost < {options.loss} and loses()", do: lost += 1}}')
    lines.append(f'        - {{do: "send get({values}){later}"}}')
    return "\n".join(lines) + "\n"


def without_channels(system: System) -> System:
    """Return a system in which all connections are direct: the one that code is generated from."""
    onward = {
        link.source: link for link in system.event_links if system.machines[link.source].is_channel
    }
    links = tuple(
        replace(link, target=onward[link.target].target, event=onward[link.target].event)
        if link.target in onward
        else link
        for link in system.event_links
        if link.source not in onward
    )
    machines = tuple(machine for machine in system.machines if not machine.is_channel)
    return replace(system, machines=machines, event_links=links)
