"""Archives of Rhapsody, written from short descriptions."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from xml.sax.saxutils import escape

from fsmkit.diagnostics import Findings, Source, Text
from fsmkit.foreign.rhapsody.archive import Node, read_archive

HEAD = "I-Logix-RPY-Archive version 8.12.0 Java 9728113\n"


def handle(kind: str, **fields: str) -> str:
    """Return a reference to an element."""
    inner = "".join(f"- _{key} = {value};\n" for key, value in fields.items())
    return f'{{ IHandle\n- _m2Class = "{kind}";\n{inner}}}'


def container(name: str, items: Iterable[str]) -> str:
    """Return a field that holds objects."""
    found = list(items)
    inner = "".join(f"{item}\n" for item in found)
    return f"- {name} = {{ IRPYRawContainer\n- size = {len(found)};\n- value =\n{inner}}}\n"


def quoted(text: str) -> str:
    """Return a string."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def state(id_: str, parent: str = "root", kind: str = "", **actions: str) -> str:
    """Return a state; its name is its id. ``actions``: ``entry`` and ``exit``."""
    lines = (
        f"{{ IState\n- _id = GUID {id_};\n- _name = {quoted(id_)};\n- _parent = GUID {parent};\n"
    )
    lines += f"- _stateType = {kind};\n" if kind else ""
    for name, body in actions.items():
        lines += f"- _{name}Action = {{ IAction\n- _body = {quoted(body)};\n}}\n"
    return lines + "- _defaultTrans = ;\n}"


def connector(id_: str, kind: str, parent: str = "root") -> str:
    """Return a connector; its name is its id."""
    return (
        f"{{ IBranch\n- _id = GUID {id_};\n- _name = {quoted(id_)};\n- _parent = GUID {parent};\n"
        f"- _connectorType = {kind};\n}}"
    )


def label(trigger: str = "", guard: str = "", action: str = "") -> str:
    """Return a label: ``trigger`` is an event, ``tm(...)`` or empty."""
    lines = "- _itsLabel = { ILabel\n"
    if trigger.startswith("tm("):
        body = f"- _body = {quoted(trigger)};\n- _time = {quoted(trigger[3:-1])};\n"
        lines += f"- _itsTrigger = {{ ITimeout\n{body}}}\n"
    elif trigger:
        item = handle("IEvent", id=f"GUID event-{trigger}")
        body = f"- _body = {quoted(trigger)};\n- _itsInterfaceItem = {item}\n"
        lines += f"- _itsTrigger = {{ IInterfaceItemTrigger\n{body}}}\n"
    else:
        lines += "- _itsTrigger = NULL;\n"
    for key, kind, body in (("Guard", "IGuard", guard), ("Action", "IAction", action)):
        inner = f"{{ {kind}\n- _body = {quoted(body)};\n}}" if body else "NULL;"
        lines += f"- _its{key} = {inner}\n"
    return lines + "}\n"


def move(source: str, target: str, *, static: int = 0, **parts: str) -> str:
    """Return a transition; ``parts`` are those of a label."""
    return (
        f"{{ ITransition\n{label(**parts)}- _itsTarget = GUID {target};\n"
        f"- _staticReaction = {static};\n- _itsSource = GUID {source};\n}}"
    )


def default(outer: str, target: str, action: str = "") -> str:
    """Return the default transition of a state."""
    return (
        f"{{ IDefaultDrvdTrans\n{label(action=action)}- _itsTarget = GUID {target};\n"
        f"- _itsSource = ;\n- _ofState = GUID {outer};\n}}"
    )


def typed(kind: str, name: str, type_: str, value: str = "") -> str:
    """Return an attribute or an argument."""
    spec = "{ ILiteralSpecification\n- _value = " + quoted(value) + ";\n}"
    given = container("ValueSpecifications", [spec] if value else [])
    type_of = handle("IType", name=quoted(type_))
    return f"{{ {kind}\n- _name = {quoted(name)};\n{given}- _typeOf = {type_of}\n}}"


def operation(name: str, body: str) -> str:
    """Return an operation of the class."""
    inner = f"{{ IBody\n- _bodyData = {quoted(body)};\n}}"
    return f"{{ IPrimitiveOperation\n- _name = {quoted(name)};\n- _itsBody = {inner}\n}}"


def event(name: str, arguments: Iterable[str] = ()) -> str:
    """Return an event of the package."""
    return (
        f"{{ IEvent\n- _id = GUID event-{name};\n- _name = {quoted(name)};\n"
        f"{container('Args', arguments)}}}"
    )


def archive(
    states: Iterable[str],
    moves: Iterable[str],
    *,
    connectors: Iterable[str] = (),
    attributes: Iterable[str] = (),
    operations: Iterable[str] = (),
    events: Iterable[str] = (),
    name: str = "Door",
) -> str:
    """Return a package with one class."""
    root = "{ IState\n- _id = GUID root;\n- _parent = ;\n- _defaultTrans = ;\n}"
    chart = (
        f"{{ IStateChart\n- _name = {quoted('statechart_0')};\n"
        f"- _itsStateChart = {handle('')}\n{container('Transitions', moves)}"
        f"{container('Connectors', connectors)}{container('States', [root, *states])}}}"
    )
    class_ = (
        f"{{ IClass\n- _name = {quoted(name)};\n{container('Attrs', attributes)}"
        f"{container('Operations', operations)}{container('StateCharts', [chart])}}}"
    )
    package = f"{{ ISubsystem\n{container('Classes', [class_])}{container('Events', events)}}}\n"
    return HEAD + textwrap.indent(package, "\t")


PARTS = ("States", "Transitions", "Connectors", "Attrs", "Args", "Operations", "StateCharts",
         "ValueSpecifications", "Events", "Classes", "_itsLabel", "_itsTrigger", "_itsGuard",
         "_itsAction")  # fmt: skip
"""Fields whose objects the XML format puts behind the object, with a list of their ids."""


def as_xml(text: str) -> str:
    """Return an archive in Rhapsody's XML format."""
    findings = Findings()
    lines: list[str] = []
    for node in read_archive(Source("archive.sbs", text), findings):
        _write(node, lines)
    findings.stop_on_errors()
    inner = "\n".join(lines)
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<RhapsodyArchive>\n<version>109.0.1</version>\n'
        f"<RHAPSODY-MODEL>\n{inner}\n</RHAPSODY-MODEL>\n</RhapsodyArchive>\n"
    )


def _write(node: Node, lines: list[str]) -> str:
    """Add an object, and its parts behind it; return its id."""
    id_ = node.word("_id") or f"GUID part-{node.span.start}"
    fields, parts = [], []
    for name, values in node.fields.items():
        inner = node.items(name) or [one for one in values if isinstance(one, Node)]
        if name in PARTS and inner and node.node(name) is not None:
            parts += [one for one in inner if one.kind != "IRPYRawContainer"]
        elif name != "_id":
            fields.append(_field(node, name, values))
    own = f'<_id type="a">{id_}</_id>' + "".join(fields)
    start = len(lines)
    lines.append("")
    ids = "".join(f"<value>{_write(part, lines)}</value>" for part in parts)
    own += f'<AggregatesList type="e">{ids}</AggregatesList>' if ids else ""
    lines[start] = f'<{node.kind} type="e">{own}</{node.kind}>'
    return id_


def _field(node: Node, name: str, values: list[Node | Text]) -> str:
    tag = f"_h{name[1:]}" if node.kind == "IHandle" else name
    found = ""
    for value in values:
        if isinstance(value, Text):
            found += escape(value.value).replace("\n", "%0D\n")
        else:
            inner = "".join(_field(value, *item) for item in value.fields.items())
            found += f'<{value.kind} type="e">{inner}</{value.kind}>'
    return f'<{tag} type="a">{found}</{tag}>'
