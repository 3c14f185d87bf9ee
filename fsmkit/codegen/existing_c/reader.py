"""Reads `charger.c.yaml`, the binding of a chart to existing C."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path as File

from fsmkit.chart.loading import read_bytes
from fsmkit.codegen.existing_c import keys
from fsmkit.codegen.existing_c.model import (
    Binding,
    Bound,
    BoundType,
    ChosenName,
    Context,
    Exports,
    Path,
)
from fsmkit.codegen.existing_c.tokens import CExpression, read_expression
from fsmkit.diagnostics import Findings, FsmkitError, Source, Text, fail
from fsmkit.diagnostics.paths import is_file
from fsmkit.document.keys import Keys
from fsmkit.yaml import nodes
from fsmkit.yaml.encoding import decode
from fsmkit.yaml.nodes import Mapping as Entries

SUFFIXES = (".c.yaml", ".c.yml")
"""The suffixes of binding files."""
HEADER = re.compile(r"<[\w./+@ -]+>|[\w./+@ -]+", re.ASCII)
TYPE = re.compile(r"[A-Za-z_]\w*(\s+[A-Za-z_]\w*)*", re.ASCII)
MEMBER = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*|\[\d+\])*", re.ASCII)
IDENTIFIER = re.compile(r"[A-Za-z]\w*", re.ASCII)
CHOSEN = re.compile(r"(\w+)\s+(\S.*)")
EXAMPLE = "write `binding: Charger` and `chart: charger.yaml`"


def beside(chart: File) -> File | None:
    """Return the binding beside a chart with the chart's name, if it exists."""
    found = (chart.with_name(chart.stem + suffix) for suffix in SUFFIXES)
    return next((path for path in found if is_file(path)), None)


def read_binding(path: File, findings: Findings) -> Binding:
    """Return the binding of a file, including the bindings that it extends.

    Raises:
        FsmkitError: With every finding, if it is not valid.

    """
    return _read(path, findings, None, ())


def binding_of_text(text: str, name: str, findings: Findings) -> Binding:
    """Return the binding of a text that extends no other; ``name``: the name of its file.

    Raises:
        FsmkitError: With every finding, if it is not valid.

    """
    root = nodes.read_nodes(Source(name, text), findings)
    found = None if root is None else _binding(root, findings)
    findings.stop_on_errors()
    if found is None:
        raise FsmkitError(findings)
    return found


def chart_of(binding: Binding) -> File:
    """Return the file of the chart that a binding is for."""
    return File(binding.span.source.name).parent / binding.chart.value


def _read(path: File, findings: Findings, at: Text | None, readers: tuple[str, ...]) -> Binding:
    here = os.path.realpath(path)
    if here in readers:
        chain = " -> ".join(File(each).name for each in (*readers[readers.index(here) :], here))
        raise fail(
            "inheritance-cycle", f"a binding extends itself: {chain}", at,
            help="remove one `extends` of the cycle",
        )  # fmt: skip
    source = decode(read_bytes(path, at), str(path), findings)
    findings.stop_on_errors()
    root = None if source is None else nodes.read_nodes(source, findings)
    own = None if root is None else _binding(root, findings)
    findings.stop_on_errors()
    if own is None:
        raise FsmkitError(findings)
    if own.extends is None:
        return own
    base = _read(path.parent / own.extends.value, findings, own.extends, (*readers, here))
    return _merged(own, base)


def _merged(own: Binding, base: Binding) -> Binding:
    """Return a binding with the entries of its base that it lacks."""
    return replace(
        own,
        includes=tuple(dict.fromkeys((*base.includes, *own.includes))),
        context=own.context or base.context,
        constants={**base.constants, **own.constants},
        types={**base.types, **own.types},
        operations={**base.operations, **own.operations},
        sends={**base.sends, **own.sends},
        inputs={**base.inputs, **own.inputs},
        outputs={**base.outputs, **own.outputs},
        names={**base.names, **own.names},
        exports=own.exports or base.exports,
    )


def _binding(root: nodes.Node, findings: Findings) -> Binding | None:
    parts = nodes.require_record(root, keys.BINDING, "a binding", findings)
    if parts is None:
        return None
    name = nodes.require_text(parts.get("binding"), "`binding`", findings)
    chart = nodes.require_text(parts.get("chart"), "`chart`", findings)
    if name is None or chart is None or not name.value or not chart.value:
        findings.add(
            "broken-binding", "a binding needs `binding` and `chart`", root.span, help=EXAMPLE
        )
        return None
    reader = _Reader(findings)
    return Binding(
        name,
        chart,
        root.span,
        includes=reader.includes(parts.get("include")),
        context=reader.context(parts.get("context")),
        constants=reader.bound(parts.get("constants"), "constants"),
        types=reader.types(parts.get("types")),
        operations=reader.bound(parts.get("operations"), "operations", keys.OPERATION, "call"),
        sends=reader.bound(parts.get("sends"), "sends"),
        inputs=reader.bound(parts.get("inputs"), "inputs", keys.INPUT, "get"),
        outputs=reader.bound(parts.get("outputs"), "outputs", keys.OUTPUT, "set"),
        names=reader.names(parts.get("names")),
        exports=reader.exports(parts.get("exports")),
        extends=nodes.require_text(parts.get("extends"), "`extends`", findings),
    )


class _Reader:
    """Reads the parts of a binding; an invalid part counts as missing, after a finding."""

    def __init__(self, findings: Findings) -> None:
        self.findings = findings

    def includes(self, node: nodes.Node | None) -> tuple[str, ...]:
        if node is None:
            return ()
        items = node.items if isinstance(node, nodes.Sequence) else (node,)
        found = []
        for item in items:
            text = self._matching(item, HEADER, "the name of a header, as `bms.h` or `<bms.h>`")
            if text is not None:
                name = text.value
                found.append(name if name.startswith("<") else f'"{name}"')
        return tuple(dict.fromkeys(found))

    def context(self, node: nodes.Node | None) -> Context | None:
        parts = nodes.require_record(node, keys.CONTEXT, "`context`", self.findings)
        if node is None or parts is None:
            return None
        type_ = self._matching(parts.get("type"), TYPE, "a type of C, as `struct board`")
        member = self._matching(parts.get("member"), MEMBER, "a member, as `machine`")
        expression = self._expression(parts.get("expression"), "`expression`")
        if type_ is None or (member is None) == (expression is None):
            if not self.findings.has_errors:
                self.findings.add(
                    "broken-binding",
                    "`context` needs `type`, and either `member` or `expression`",
                    node.span,
                    help="write `{type: struct board, member: machine}`",
                )
            return None
        name = "" if member is None else member.value
        return Context(_spaced(type_), name, expression, type_)

    def bound(
        self, node: nodes.Node | None, what: str, record: Keys | None = None, key: str = ""
    ) -> Mapping[str, Bound]:
        """Return expressions by name; ``record``: the keys of an entry with several parts."""
        found = {}
        for name, value in nodes.entries_of(node, f"`{what}`", self.findings):
            is_trusted = False
            inside: nodes.Node | None = value
            if record is not None and isinstance(value, Entries):
                parts = (
                    nodes.require_record(value, record, f"an entry of `{what}`", self.findings)
                    or {}
                )
                is_trusted = self._flag(parts.get("trusted"), "trusted")
                inside = parts.get(key)
                if inside is None and parts.keys() <= record.keys():
                    self.findings.add(
                        "broken-binding", f"`{name}` needs `{key}`", name,
                        help=f"write `{{{key}: an expression of C}}`",
                    )  # fmt: skip
            expression = self._expression(inside, f"`{name}`")
            if expression is not None:
                is_setter = key == "set" and inside is not value
                found[name.value] = Bound(name, expression, is_trusted, is_setter)
        return found

    def types(self, node: nodes.Node | None) -> Mapping[str, BoundType]:
        found = {}
        for name, value in nodes.entries_of(node, "`types`", self.findings):
            parts = nodes.require_record(value, keys.TYPE, f"the type `{name}`", self.findings)
            if parts is None:
                continue
            type_ = self._matching(parts.get("type"), TYPE, "a type of C, as `bms_status`")
            if type_ is None:
                if "type" not in parts:
                    self.findings.add(
                        "broken-binding", f"the type `{name}` needs `type`", name,
                        help="write the type in C: `type: bms_status`",
                    )  # fmt: skip
                continue
            members = self.bound(parts.get("members"), "members")
            fields = {}
            for field, member in nodes.entries_of(parts.get("fields"), "`fields`", self.findings):
                text = self._matching(member, MEMBER, "a member of the type, as `temp_dc`")
                if text is not None:
                    fields[field.value] = Path(field, text)
            found[name.value] = BoundType(name, _spaced(type_), members, fields)
        return found

    def names(self, node: nodes.Node | None) -> Mapping[tuple[str, str], ChosenName]:
        found = {}
        for key, value in nodes.entries_of(node, "`names`", self.findings):
            text = self._matching(value, IDENTIFIER, "an identifier of C")
            parts = CHOSEN.fullmatch(key.value.strip())
            if parts is None or parts[1] not in keys.KINDS:
                self.findings.add(
                    "broken-binding", f"`{key}` has no kind and name", key,
                    help=f"write `type Fault: charger_fault_code`; kinds are {_listed(keys.KINDS)}",
                )  # fmt: skip
            elif text is not None:
                chosen = ChosenName(parts[1], parts[2], text.value, key)
                found[chosen.kind, chosen.name] = chosen
        return found

    def exports(self, node: nodes.Node | None) -> Exports | None:
        text = nodes.require_text(node, "`exports`", self.findings)
        if text is None:
            return None
        known = {each.value: each for each in Exports}
        if text.value not in known:
            self.findings.add(
                "unexpected-value", f"`exports` cannot be `{text}`", text,
                help=f"write {_listed(tuple(known))}",
            )  # fmt: skip
        return known.get(text.value)

    def _expression(self, node: nodes.Node | None, what: str) -> CExpression | None:
        text = nodes.require_text(node, what, self.findings)
        return None if text is None else read_expression(text, self.findings)

    def _flag(self, node: nodes.Node | None, key: str) -> bool:
        text = nodes.require_text(node, f"`{key}`", self.findings)
        if text is not None and text.value not in ("true", "false"):
            self.findings.add(
                "unexpected-value", f"`{key}` cannot be `{text}`", text, help="write true or false"
            )
        return text is not None and text.value == "true"

    def _matching(
        self, node: nodes.Node | None, pattern: re.Pattern[str], what: str
    ) -> Text | None:
        if node is not None and not isinstance(node, nodes.Scalar):
            nodes.require_text(node, what, self.findings)
            return None
        text = nodes.require_text(node, what, self.findings)
        if text is None or pattern.fullmatch(text.value):
            return text
        self.findings.add("binding-syntax", f"`{text}` is not {what}", text, help=f"write {what}")
        return None


def _spaced(type_: Text) -> str:
    return " ".join(type_.value.split())


def _listed(words: tuple[str, ...]) -> str:
    return f"{', '.join(words[:-1])} or {words[-1]}"
