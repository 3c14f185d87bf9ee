"""Archives of Rhapsody, written from short descriptions."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable

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
