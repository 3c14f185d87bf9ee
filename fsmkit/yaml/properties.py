"""``properties:`` and ``environment:`` of a chart, read into a Document and written."""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.diagnostics import Findings, Text
from fsmkit.diagnostics.suggestions import suggest_key
from fsmkit.document import keys
from fsmkit.document.document import DocEnvironment, DocProperty
from fsmkit.yaml import nodes
from fsmkit.yaml.fields import Fields, names
from fsmkit.yaml.layout import Short, Tree
from fsmkit.yaml.writing import listed, mapping, write_keys

PARTS = {1: ("first",), 2: ("first", "then"), 3: ("first", "time", "then")}
"""The fields of the items of a list under a kind, by the number of items."""
KEYS = {**keys.PROPERTY, **keys.WATCH, **keys.REQUIRED}


def read_properties(fields: Fields, findings: Findings) -> Iterator[DocProperty]:
    """Yield the readable properties."""
    for name, node in fields.entries("properties"):
        if isinstance(node, nodes.Scalar):
            kind = node.text.strip()
            if kind.value in keys.PROPERTY:
                yield DocProperty(name, kind)
            else:
                known = f"use one of {', '.join(keys.PROPERTY)}"
                findings.add(
                    "unknown-name", f"there is no kind of property `{kind}`", kind,
                    help=suggest_key(kind.value, keys.PROPERTY, known),
                )  # fmt: skip
            continue
        entries = nodes.require_mapping(node, f"the property `{name}`", findings)
        if entries is None:
            continue
        nodes.check_keys(entries, KEYS, f"the property `{name}`", findings)
        found = _of_kind(name, entries, findings)
        if found is not None:
            yield found


def _of_kind(name: Text, entries: nodes.Mapping, findings: Findings) -> DocProperty | None:
    kinds = [(key, value) for key, value in entries.entries if key.value in keys.PROPERTY]
    own = {key.value: value for key, value in entries.entries}
    if len(kinds) != 1:
        if kinds or own.keys() <= KEYS.keys():
            findings.add(
                "unexpected-shape",
                f"the property `{name}` must be one kind with its condition",
                name if entries.span.start == entries.span.end else entries.span,
                help="for instance `{never: In(pushing) and not door_closed}`",
            )
        return None
    ((kind, value),) = kinds
    items: tuple[nodes.Node, ...] = value.items if isinstance(value, nodes.Sequence) else (value,)
    if len(items) not in PARTS:
        findings.add(
            "unexpected-shape",
            f"`{name}` has {len(items)} parts",
            value.span,
            help=f"`{kind}` takes {keys.PROPERTY[kind.value].doc}",
        )
        return None
    texts = [nodes.require_text(item, f"the condition of `{name}`", findings) for item in items]
    parts = {
        part: text for part, text in zip(PARTS[len(items)], texts, strict=True) if text is not None
    }
    watched = tuple(nodes.texts_of(own.get("watch"), "`watch`", "what is watched", findings))
    first, time, then = (parts.get(part) for part in PARTS[3])
    req = names(own.get("req"), "`req`", findings)
    return DocProperty(name, kind, first, time, then, watched, req=req)


def read_environment(fields: Fields, findings: Findings) -> DocEnvironment | None:
    """Return the environment of a chart; None if the chart does not declare one."""
    node = fields.node("environment")
    entries = nodes.require_mapping(node, "`environment`", findings)
    if node is None or entries is None:
        return None
    inner = Fields(entries, keys.OWN_ENVIRONMENT, "`environment` of a chart", findings)
    return DocEnvironment(inner.texts("may"), inner.texts("will"), fields.keys["environment"].span)


def write_properties(properties: tuple[DocProperty, ...]) -> dict[str, Tree]:
    """Return properties as a mapping."""
    return mapping((one.name, _property(one)) for one in properties)


def _property(one: DocProperty) -> Tree:
    parts = [part.value for part in (one.first, one.time, one.then) if part is not None]
    if not parts and not one.watch and not one.req:
        return one.kind.value
    condition: Tree = Short([*parts]) if len(parts) > 1 else parts[0] if parts else "true"
    tree: dict[str, Tree] = {one.kind.value: condition, **write_keys(one, keys.REQUIRED)}
    if one.watch:
        tree["watch"] = [text.value for text in one.watch]
        return tree
    return Short(tree)


def write_environment(environment: DocEnvironment) -> Tree:
    """Return an environment as a mapping."""
    parts = {"may": environment.may, "will": environment.will}
    return Short({key: listed(texts) for key, texts in parts.items() if texts})
