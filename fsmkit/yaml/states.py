"""Reading of YAML nodes into the states of a Document."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from fsmkit.diagnostics import Findings, Text
from fsmkit.document import keys
from fsmkit.document.document import HISTORIES, DocExit, DocInvoke, DocState, Document, DocUse, Kind
from fsmkit.yaml.fields import Fields
from fsmkit.yaml.nodes import Mapping, Node, Sequence, require_mapping
from fsmkit.yaml.transitions import read_exit, read_initial, read_transitions

KINDS = {
    "regions": Kind.PARALLEL,
    "states": Kind.COMPOUND,
    "choice": Kind.CHOICE,
    "use": Kind.ATOMIC,
}
"""Keys that determine the kind of a state, besides ``final`` and ``history``."""
ARRAY = re.compile(r"(.*\S)\s*\[(\s*[^\W\d]\w*\s+in\s.*\S\s*)\]", re.DOTALL)
"""The key of an array of copies: ``axis[i in 0..1]``."""


@dataclass(frozen=True, slots=True)
class StateReader:
    """Reads states; errors go to the findings, and the rest is still read."""

    findings: Findings
    inline_chart: Callable[[Mapping], Document]
    """Reads the mapping of an inline chart of an ``invoke``."""

    def states(self, fields: Fields, key: str) -> tuple[DocState, ...]:
        """Read the ``name: state`` entries under a key."""
        return tuple(self.state(name, node) for name, node in fields.entries(key))

    def state(self, name: Text, node: Node) -> DocState:
        """Read one state, or under ``refine`` a change of one."""
        mapping = require_mapping(node, f"state `{name}`", self.findings)
        index_range = None
        if (array := ARRAY.fullmatch(name.value)) is not None:
            index_range = name.part(*array.span(2)).strip()
            name = name.part(*array.span(1))
        if not name.value:
            self.findings.add(
                "unexpected-shape", "a state needs a name", name, help="write it before the colon"
            )
        if mapping is None:
            return DocState(name, Kind.ATOMIC, name.span, index_range=index_range)
        fields = Fields(mapping, keys.STATE, f"state `{name}`", self.findings)
        kind = self._kind(fields)
        if "default" in fields and kind not in (Kind.ATOMIC, *HISTORIES):
            self.findings.add(
                "unexpected-shape",
                "only a history has a `default`",
                fields.keys["default"],
                help="write `initial` for the initial child of a state",
            )
        return DocState(
            id=name,
            kind=kind,
            span=name.span,
            initial=read_initial(
                fields, "default" if "default" in fields else "initial", self.findings
            ),
            children=self.states(fields, "regions") or self.states(fields, "states"),
            transitions=read_transitions(fields, self.findings),
            invokes=self._invokes(fields.node("invoke")),
            use=self._use(fields),
            index_range=index_range,
            **self._done(fields.node("done")),
            **fields.read(),
        )

    def _kind(self, fields: Fields) -> Kind:
        """Return the kind of a state by its keys; two kinds are a finding."""
        found = [(key, kind) for key, kind in KINDS.items() if key in fields]
        if fields.flag("final"):
            found.append(("final", Kind.FINAL))
        if "history" in fields:
            depths = {"shallow": Kind.SHALLOW_HISTORY, "deep": Kind.DEEP_HISTORY}
            found.append(("history", fields.one_of("history", depths)))
        if len(found) > 1:
            (first, _), (second, _), *_ = found
            self.findings.add(
                "unexpected-shape",
                f"a state cannot have both `{first}` and `{second}`",
                fields.keys[second],
                secondary=[(fields.keys[first], "the other")],
                help="choose one of them, or put a state with the other into it",
            )
        return found[0][1] if found else Kind.ATOMIC

    def _use(self, fields: Fields) -> DocUse | None:
        """Read the used chart and its bindings; a refinement may have only bindings."""
        given = [key for key in ("use", *keys.USED, "exits") if key in fields]
        if not given:
            return None
        node = fields.node("use")
        use: dict[str, Any] = {}
        if isinstance(node, Mapping):
            use = Fields(node, keys.USE, "`use`", self.findings).read()
        elif node is not None:
            use["chart"] = fields.name("use")
        pairs: dict[str, Any] = {field: fields.arguments(key) for key, field in keys.USED.items()}
        exits = tuple(
            DocExit(name, read_exit(exit_, name, self.findings))
            for name, exit_ in fields.entries("exits")
        )
        return DocUse(fields.keys[given[0]].span, **use, **pairs, exits=exits)

    def _done(self, node: Node | None) -> dict[str, Any]:
        mapping = require_mapping(node, "`done`", self.findings)
        return {} if mapping is None else Fields(mapping, keys.DONE, "`done`", self.findings).read()

    def _invokes(self, node: Node | None) -> tuple[DocInvoke, ...]:
        if node is None:
            return ()
        items = node.items if isinstance(node, Sequence) else (node,)
        mappings = (require_mapping(item, "`invoke`", self.findings) for item in items)
        return tuple(self._invoke(mapping) for mapping in mappings if mapping is not None)

    def _invoke(self, mapping: Mapping) -> DocInvoke:
        fields = Fields(mapping, keys.INVOKE, "`invoke`", self.findings)
        node = fields.node("content")
        chart = require_mapping(node, "`content`", self.findings)
        inline = None if chart is None else self.inline_chart(chart)
        return DocInvoke(mapping.span, content=inline, **fields.read())
