"""Bundle a chart or a system as one HTML file: generated JavaScript, schedule and hub.

Modules become functions of one script, so the file opens by ``file://``. Its policy forbids other
scripts, requests, and evaluation of strings.
"""

from __future__ import annotations

import json
import os
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from fsmkit.chart.chart import Chart, every_operation
from fsmkit.codegen.javascript.expressions import Printer
from fsmkit.codegen.javascript.generate import class_name, module_text
from fsmkit.emit import printing
from fsmkit.emit.javascript import quoted
from fsmkit.inspector import page
from fsmkit.inspector.breakpoints import machine_without_prefix
from fsmkit.inspector.charts import chart_message, type_json
from fsmkit.inspector.page import Page
from fsmkit.language import BOOL, Expr, Storage, Value, Variable, format_expression
from fsmkit.language.walk import nodes
from fsmkit.runtime.interpreter.index import index_of
from fsmkit.runtime.library import JAVASCRIPT_LIBRARY
from fsmkit.runtime.live import messages
from fsmkit.runtime.live.steps import hash_of
from fsmkit.runtime.live.values import to_json
from fsmkit.runtime.script import is_received
from fsmkit.system.machine import Machine
from fsmkit.system.properties.condition import Atom
from fsmkit.system.schedule import time_unit
from fsmkit.system.shared import has_data_trigger
from fsmkit.system.system import System, state_properties
from fsmkit.verify import questions
from fsmkit.verify.questions import Expression

HERE = Path(__file__).parent / "offline"
RUNTIME = ("fsmkit_runtime.mjs", "fsmkit_system.mjs")
HUB = ("live.mjs", "queries.mjs", "expressions.mjs", "history.mjs", "scripts.mjs", "hub.mjs")
"""In the order in which they import each other."""
IMPORT = re.compile(r'^import (.+) from "\./([\w.]+)";\n', re.MULTILINE)
EXPORT = re.compile(r"^export (?=(?:class|function|const) (\w+))", re.MULTILINE)
ENDING = re.compile(r"<(?=!|/?s)", re.IGNORECASE)
"""Strings that end a script in HTML, or start a comment."""
INHERITED = (re.compile(r' font-family="[^"]*"'), re.compile(r' font-size="[^"]*"'))
"""Attributes of a drawing whose most frequent value is declared once, at its root."""
SPARED = [
    (re.compile(r"<\?xml[^>]*>|<!DOCTYPE[^>]*>|<!--.*?-->|<title>[^<]*</title>", re.DOTALL), ""),
    (re.compile(r' text-anchor="start"| xlink:href="[^"]*"'), ""),
    (re.compile(r' textLength="[^"]*" lengthAdjust="\w+"'), ""),  # the page measures them
    (re.compile(r"(\d)\.0+(?=[\s,\"])"), r"\1"),
    (re.compile(r">\n+"), ">"),
]
"""Replacements in a drawing."""
TOLD = ("name", "events", "data", "outputs", "inputs")
"""Fields of a chart that clients receive, too."""
CHARSET = b'<meta charset="utf-8">'
ELSEWHERE = ("connect-src", "frame-ancestors")
"""Directives of a served page's policy that a file cannot have."""
Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Scenario:
    """A scenario to play: ``actions`` of a script as commands, or ``entries`` of a path."""

    name: str
    content: Json


def simulating_page(
    system: System,
    *,
    file: str = "",
    conditions: Sequence[str] = (),
    scenarios: Sequence[Scenario] = (),
) -> Page:
    """Return a page that simulates a system.

    Args:
        system: The system; a single chart is a system of one machine.
        file: The file name that saved tests mention.
        conditions: Conditions to stop at, as breakpoints.
        scenarios: Scenarios that the page can play.

    Raises:
        FsmkitError: For an invalid condition, and for machines with different ticks.

    """
    time_unit(system)
    here = script(system, file=file, conditions=conditions, scenarios=scenarios)
    transport = page.SPARED.sub("", (HERE / "transport.js").read_text(encoding="utf-8"))
    served = page.assemble_page(here + transport, is_spared=True)
    kept = [part for part in served.policy.split("; ") if not part.startswith(ELSEWHERE)]
    policy = "; ".join(kept)
    meta = f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
    text = served.text.replace(CHARSET, CHARSET + b"\n" + meta.encode(), 1)
    return Page(text, policy)


def script(
    system: System,
    *,
    file: str = "",
    conditions: Sequence[str] = (),
    scenarios: Sequence[Scenario] = (),
) -> str:
    """Return a script that defines ``offline``: the class of the hub, and the description."""
    charts = {hash_of(machine.chart): machine.chart for machine in system.machines}
    names = _names(charts.values())
    texts = {each.name: each.text for chart in charts.values() for each in chart.sources}
    descriptions = {h: _literal(chart_description(chart, names)) for h, chart in charts.items()}
    machine = machine_without_prefix(system, "")
    read = [(text, questions.read(system, text, machine, BOOL)) for text in conditions]
    fixed = {
        "name": system.name,
        "isOpen": system.is_open,
        "tick": system.machines[0].chart.capacities.tick,
        "file": file,
        "eventLinks": [
            {
                "source": e.source,
                "port": e.port,
                "target": e.target,
                "event": e.event,
                "arguments": e.arguments,
            }
            for e in system.event_links
        ],
        "inputLinks": [
            {"source": i.source, "output": i.output, "target": i.target, "input": i.input}
            for i in system.input_links
        ],
        "points": [{"do": "break", "on": "condition", "what": text} for text in conditions],
        "scenarios": [{"name": each.name, **each.content} for each in scenarios],
    }
    fixed["sources"] = {names[name]: text for name, text in texts.items()}
    return _script(system, charts, descriptions, _literal(fixed), read)


@printing
def _script(
    system: System,
    charts: Mapping[str, Chart],
    descriptions: Mapping[str, str],
    fixed: str,
    conditions: Sequence[tuple[str, Expression]],
) -> str:
    modules = {name: (JAVASCRIPT_LIBRARY / name).read_text(encoding="utf-8") for name in RUNTIME}
    modules |= {f"{hash_}.mjs": module_text(chart) for hash_, chart in charts.items()}
    modules |= {name: (HERE / name).read_text(encoding="utf-8") for name in HUB}
    lines = ['"use strict";', "const offline = (() => {", "const modules = Object.create(null);"]
    lines += [link_module(name, text) for name, text in modules.items()]
    lines += ["const charts = {"]
    lines += [f'"{hash_}": {text},' for hash_, text in descriptions.items()]
    lines += ["};"]
    lines += ["for (const chart of Object.values(charts)) {"]
    lines += [f"chart.{key} = chart.message.{key};" for key in TOLD]
    lines += ["}"]
    machines = ", ".join(_machine(machine) for machine in system.machines)
    compiled = [_condition(system, text, found) for text, found in conditions]
    compiled_properties = ",\n".join(_properties(system))
    lines += [
        "const description = {",
        f"...{fixed},",
        f"machines: [{machines}],",
        f"conditions: [{', '.join(compiled)}],",
        f"properties: [{compiled_properties}],",
        "};",
        "for (const { message } of Object.values(charts)) {",
        "for (const source of message.sources) source.text = description.sources[source.name];",
        "}",
        'return { Hub: modules["hub.mjs"].Hub, description };',
        "})();",
        "",
    ]
    return "\n".join(lines)


def link_module(name: str, text: str) -> str:
    """Return a module as a function that is called once and returns its exports under `name`."""
    exported = [found[1] for found in EXPORT.finditer(text)]
    body = page.SPARED.sub("", EXPORT.sub("", IMPORT.sub(_import, text)))
    return f"modules[{quoted(name)}] = (() => {{\n{body}return {{ {', '.join(exported)} }};\n}})();"


def _import(found: re.Match[str]) -> str:
    names = found[1].replace("* as ", "")
    return f"const {names} = modules[{quoted(found[2])}];\n"


def _literal(value: object) -> str:
    """Return JSON as JavaScript, in which nothing ends a script of a page."""
    text = messages.encoded(value).decode()
    escaped = (
        ENDING.sub("\\\\u003c", text).replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")
    )
    # `__proto__` in a literal is not a key
    return f"JSON.parse({json.dumps(escaped)})" if "__proto__" in escaped else escaped


# --- descriptions of charts --------------------------------------------------------------------


def chart_description(chart: Chart, names: Mapping[str, str]) -> Json:
    """Return the description of a chart for the hub, without the generated machine.

    ``names`` maps sources to shown names. Their contents, shared by charts, are not included.
    """
    told: Json = msgspec.json.decode(messages.to_json(chart_message(chart)))
    for place in ("states", "transitions", "events", "data", "inputs", "outputs"):
        for each in told[place]:
            if "at" in each:
                file = names.get(each["at"]["file"], "")
                each["at"] = {"file": file, "line": each["at"]["line"]}
    told["sources"] = [{"name": names[source.name]} for source in chart.sources]
    for wish in ("hides", "folds"):
        told.pop(wish, None)  # without Graphviz there is no new layout
    if "svg" in told:
        told["svg"] = compact_drawing(told["svg"])
    own = {key: value for key, value in _types(chart).items() if key not in TOLD}
    return {**own, "message": told, **_query_data(chart)}


def _names(charts: Iterable[Chart]) -> dict[str, str]:
    """Return the shown name of each source: its path relative to the common folder."""
    paths = dict.fromkeys(source.name for chart in charts for source in chart.sources)
    places = {path: Path(os.path.abspath(path)) for path in paths if os.path.dirname(path)}  # noqa: PTH100, PTH120
    folder = os.path.commonpath([str(place.parent) for place in places.values()] or ["."])
    within = {path: place.relative_to(folder).as_posix() for path, place in places.items()}
    return {path: within.get(path, path) for path in paths}


def compact_drawing(svg: str) -> str:
    """Return a Graphviz drawing without parts that a page ignores or that are declared above."""
    for pattern, instead in SPARED:
        svg = pattern.sub(instead, svg.strip())
    for attribute in INHERITED:
        for commonest, _ in Counter(attribute.findall(svg)).most_common(1):
            svg = svg.replace(commonest, "").replace("<svg ", f"<svg{commonest} ", 1)
    return svg if "'" in svg else svg.replace('"', "'")  # which JSON need not escape


def _types(chart: Chart) -> Json:
    """Return the types of events, inputs, operations and outputs, including invoked machines."""
    operations = every_operation(chart)
    own = [operation.name for operation in chart.operations]
    return {
        "events": [
            {
                "name": event.name,
                "fields": [{"name": f.name, "type": type_json(f.type)} for f in event.fields],
                "received": is_received(event),
            }
            for event in chart.events
        ],
        **{
            place: [{"name": v.name, "type": type_json(v.type)} for v in variables]
            for place, variables in (
                ("data", chart.data),
                ("outputs", chart.outputs),
                ("inputs", chart.inputs),
            )
        },
        "operations": [
            {
                "name": name,
                "parameters": [{"name": p.name, "type": type_json(p.type)} for p in one.parameters],
                "result": None if one.result is None else type_json(one.result),
                "tried": [_json_value(value) for value in one.tried],
            }
            for name in [*own, *(name for name in operations if name not in own)]
            for one in [operations[name]]
        ],
        "invocations": [{"id": i.id, "chart": _types(i.chart)} for i in chart.invocations],
    }


def _json_value(value: Value) -> object:
    """Return a value of a ``from`` list as the machine holds it; numbers as text, of any size."""
    match value:
        case tuple():
            return [_json_value(part) for part in value]
        case bool() | str():
            return value
        case int():
            return {"int": str(value)}
        case _:
            return {"float": str(value)}


def _query_data(chart: Chart) -> Json:
    """Return the data for queries: guards as text, constants, types."""
    return {
        "guards": {
            str(t.index): {
                "text": format_expression(t.guard, chart.capacities.tick),
                "reads": _event_fields(chart, t.guard),
            }
            for t in chart.transitions
            if t.guard is not None
        },
        "typedConstants": [
            {"name": n, "type": type_json(c.type), "value": to_json(c.value, c.type)}
            for n, c in chart.constants
        ],
        "types": [type_json(type_) for type_ in chart.types],
    }


def _event_fields(chart: Chart, guard: Expr) -> list[list[Any]]:
    """Return the variables of a guard: where each is held, its name and type."""
    places = {Storage.DATA: "data", Storage.OUTPUT: "outputs", Storage.INPUT: "inputs"}
    slots = index_of(chart).slots
    read = {node.name: node for node in nodes(guard) if isinstance(node, Variable)}
    return [
        [places[node.storage], name, type_json(node.type)]
        for name, node in read.items()
        if name in slots
    ]


def _machine(machine: Machine) -> str:
    """Return a machine of the description."""
    chart = machine.chart
    hash_ = hash_of(chart)
    fixed = {
        "name": machine.name,
        "environment": machine.environment,
        "shared": [{"data": slot.data, "element": slot.element} for slot in machine.shared],
        "triesEventless": has_data_trigger(machine, chart),
    }
    class_ = f'modules["{hash_}.mjs"].{class_name(chart)}'
    return f'{{ ...{_literal(fixed)}, Machine: {class_}, chart: charts["{hash_}"] }}'


# --- conditions ---------------------------------------------------------------------------------


def _condition(system: System, text: str, found: Expression) -> str:
    """Return the compiled form of a condition given at build time."""
    machine = machine_without_prefix(system, "")
    where = "null" if machine is None else str(machine)
    value = _compiled(system, found.tree, machine, found.atoms)
    return f"{{ text: {quoted(text)}, machine: {where}, value: {value} }}"


def _properties(system: System) -> Iterator[str]:
    """Yield the properties of states."""
    for each in state_properties(system):
        if each.condition is not None:
            value = _compiled(system, each.condition, each.owner, each.atoms)
            negated = "true" if each.is_negated else "false"
            yield f"{{ name: {quoted(each.name)}, isNegated: {negated}, value: {value} }}"


def _compiled(
    system: System, tree: Expr, machine: int | None, atoms: Iterable[tuple[str, Atom]]
) -> str:
    """Return a function from the snapshots of all machines to the value of an expression."""
    text = Printer({}).print(tree)
    if machine is not None:
        own = f"snapshots[{machine}]"
        world = f"{{ ...{own}, _active: {own}.active, _clamp: rt.nearest }}"
    else:
        held = ", ".join(f"{quoted(n)}: {_atom(system, atom)}" for n, atom in atoms)
        world = f"{{ data: {{ __proto__: null, {held} }}, _clamp: rt.nearest }}"
    return f'(snapshots) => {{ const rt = modules["fsmkit_runtime.mjs"]; const m = {world}; return {text}; }}'  # noqa: E501


def _atom(system: System, atom: Atom) -> str:
    snapshot = f"snapshots[{atom.machine}]"
    if atom.event is not None:
        return "false"
    if atom.state is not None:
        return f"{snapshot}.active[{atom.state}]"
    chart = system.machines[atom.machine].chart
    places = (("data", chart.data), ("outputs", chart.outputs), ("inputs", chart.inputs))
    place = next(p for p, variables in places if any(v.name == atom.variable for v in variables))
    return f"{snapshot}.{place}[{quoted(atom.variable)}]"
