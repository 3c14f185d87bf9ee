"""Read ``properties:`` of a system file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from fsmkit.diagnostics import Findings, Text
from fsmkit.diagnostics.suggestions import suggest_key
from fsmkit.language import BOOL, Scope, read_duration
from fsmkit.system.conditions import constants_of, read_condition, read_expression
from fsmkit.system.indices import expand_quantifiers
from fsmkit.system.machine import Machine, Monitor
from fsmkit.system.properties.condition import Condition
from fsmkit.system.properties.kinds import kinds
from fsmkit.system.properties.property import Kind, OverGraph, Part, Property
from fsmkit.system.qualified_names import in_condition
from fsmkit.yaml import nodes
from fsmkit.yaml.fields import names


@dataclass(slots=True)
class Reading:
    """The context for reading properties; ``monitors``: receives the machines that they add.

    ``own``: the machine whose chart has the properties, so that names need no machine.
    """

    machines: tuple[Machine, ...]
    folder: Path
    findings: Findings
    strict: bool = False
    monitors: list[Monitor] = field(default_factory=list)
    own: int | None = None

    def properties(self, node: nodes.Node | None) -> Iterator[Property]:
        """Yield the readable properties, in their order."""
        for name, value in nodes.entries_of(node, "`properties`", self.findings):
            if (found := self._property(name, value)) is not None:
                yield found

    def _property(self, name: Text, node: nodes.Node) -> Property | None:
        if isinstance(node, nodes.Scalar):
            kind = self._kind(node.text)
            if kind is None:
                return None
            if kind.form:
                self.findings.add(
                    "missing-condition",
                    f"`{kind.key}` needs a condition",
                    node.text,
                    help=f"write `{name}: {{{kind.key}: ...}}`",
                )
                return None
            return Property(name.value, kind, kind.key, span=name.span)
        mapping = nodes.require_mapping(node, f"the property `{name}`", self.findings)
        if mapping is None:
            return None
        given = tuple(entry for entry in mapping.entries if entry[0].value != "req")
        req = names(dict(mapping.entries).get(Text("req", name.span)), "`req`", self.findings)
        found = self._mapping(name, nodes.Mapping(given, mapping.span))
        return None if found is None else replace(found, req=req)

    def _mapping(self, name: Text, mapping: nodes.Mapping) -> Property | None:
        """Return the property of a kind with its condition, or with a form of its own."""
        own = self._kind_with_form(mapping)
        if own is not None and own.read is not None:
            return own.read(name, mapping, self)
        if len(mapping.entries) != 1:
            self.findings.add(
                "unexpected-shape",
                f"the property `{name}` must have one kind with its condition",
                mapping.span,
                help="for instance `{never: feeder.In(pushing) and not plant.door_closed}`",
            )
            return None
        key, value = mapping.entries[0]
        kind = self._kind(key)
        return None if kind is None else self._of_form(name, kind, value)

    def _kind_with_form(self, mapping: nodes.Mapping) -> Kind | None:
        found = (kinds().get(key.value) for key, _ in mapping.entries)
        return next((kind for kind in found if kind is not None and kind.read is not None), None)

    def _of_form(self, name: Text, kind: Kind, node: nodes.Node) -> Property | None:
        """Read the parts of a property, one alone or several in a list."""
        parts: tuple[nodes.Node, ...] | None = (node,)[: len(kind.form)]
        if len(kind.form) > 1:
            parts = node.items if isinstance(node, nodes.Sequence) else None
        if parts is None or len(parts) != len(kind.form):
            timed = ", and a duration between them" if Part.DURATION in kind.form else ""
            self.findings.add(
                "unexpected-shape",
                f"`{name}` needs two conditions{timed}",
                node.span,
                help=f"for instance `{kind.example}`",
            )
            return None
        read = [self.condition(name, n) for n, of in zip(parts, kind.form, strict=True)
                if of is Part.CONDITION]  # fmt: skip
        times = [self._duration(name, n) for n, of in zip(parts, kind.form, strict=True)
                 if of is Part.DURATION]  # fmt: skip
        conditions = [condition for condition in read if condition is not None]
        if len(conditions) < len(read) or None in times:
            return None
        atoms = [atom for condition in conditions for _, atom in condition.atoms]
        if isinstance(kind.decided, OverGraph) and any(a.event is not None for a in atoms):
            self.findings.add(
                "unexpected-value",
                f"`{kind.key}` is about states, `occurs` in `{name}` about a step",
                name,
                help="use `occurs` in `never`, `invariant` or `reachable`",
            )
        return Property(
            name.value,
            kind,
            property_source(node) if kind.form else kind.key,
            conditions[0].expression if conditions else None,
            conditions[0].atoms if conditions else (),
            goal=conditions[1] if len(conditions) > 1 else None,
            ticks=next((ticks for ticks in times if ticks is not None), 0),
            span=name.span,
        )

    def condition(self, name: Text, node: nodes.Node) -> Condition | None:
        """Parse a condition of the property of that name; None after a finding."""
        text = nodes.require_text(node, f"the condition of `{name}`", self.findings)
        machines, findings = self.machines, self.findings
        written_out = None if text is None else expand_quantifiers(text, machines, findings)
        if written_out is None or self.own is None:
            return None if written_out is None else read_condition(written_out, machines, findings)
        machine = machines[self.own]
        named = in_condition(written_out, machine)
        return read_expression(named, machines, findings, BOOL, chart=machine.chart)

    def _duration(self, name: Text, node: nodes.Node) -> int | None:
        text = nodes.require_text(node, f"the time of `{name}`", self.findings)
        tick = self.machines[0].chart.capacities.tick
        machines = self.machines if self.own is None else (self.machines[self.own],)
        scope = Scope(constants=constants_of(machines), tick=tick)
        return None if text is None else read_duration(text, scope, self.findings)

    def _kind(self, text: Text) -> Kind | None:
        known = kinds()
        if text.value not in known:
            self.findings.add(
                "unknown-name",
                f"there is no kind of property `{text}`",
                text,
                help=suggest_key(text.value, known, f"use one of {', '.join(known)}"),
            )
        return known.get(text.value)


def property_source(node: nodes.Node) -> str:
    """Return the source of a property on one line."""
    return " ".join(node.span.source.text[node.span.start : node.span.end].split())
