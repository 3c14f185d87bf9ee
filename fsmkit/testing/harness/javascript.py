"""Run generated JavaScript machines by scripts in Node, for the differential test."""

from __future__ import annotations

import json
import math
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import assert_never

import fsmkit.language as lang
from fsmkit.chart.chart import Chart, every_operation, result_types
from fsmkit.codegen.javascript.expressions import SAFE, Printer
from fsmkit.codegen.javascript.generate import RUNTIME, class_name, library, module_text
from fsmkit.diagnostics import Findings, Text, fail
from fsmkit.diagnostics.parsing import parse_json
from fsmkit.language.values import part_types
from fsmkit.plan.environment_only import report_environment_only
from fsmkit.runtime.interpreter.trace import event_text
from fsmkit.runtime.script import read_line, script_texts, wrong_line

DRIVER = Path(__file__).parent / "driver.mjs"
SECONDS = 300
"""For all machines of one call."""


def run_many(jobs: Sequence[tuple[Chart, Sequence[str]]], *, safe: int = SAFE) -> list[list[str]]:
    """Run each machine by its script in one Node process; return their traces.

    A machine without a trace runs beside each; a difference is added to the trace. Raises
    `FsmkitError` for an invalid line, a rejected chart, or without Node.
    """
    findings = Findings()
    for chart, _ in jobs:
        report_environment_only(chart, findings, "javascript-sometimes")
    findings.stop_on_errors()
    node = shutil.which("node")
    if node is None:
        raise fail("no-node", "there is no `node` on the path", help="install Node.js")
    with tempfile.TemporaryDirectory(prefix="fsmkit_") as folder:
        here = Path(folder)
        for name, text in library(saved=True).items():
            (here / name).write_text(text, encoding="utf-8")
        prepared = [
            _prepared(chart, script, here / f"chart_{number}.mjs", safe)
            for number, (chart, script) in enumerate(jobs)
        ]
        given = json.dumps({"runtime": str(here / RUNTIME), "jobs": prepared})
        try:
            done = subprocess.run(
                [node, str(DRIVER)],
                input=given,
                capture_output=True,
                encoding="utf-8",
                timeout=SECONDS,
                check=False,
            )
        except subprocess.TimeoutExpired as error:
            raise fail("harness-failed", f"Node did not end within {SECONDS} s") from error
    if done.returncode:
        raise fail("harness-failed", "Node failed: " + done.stderr[-2000:])
    traces: list[list[str]] = parse_json(done.stdout)
    return traces


def _prepared(chart: Chart, script: Sequence[str], file: Path, safe: int) -> dict[str, object]:
    """Write the module of a chart; return the arguments of the driver."""
    file.write_text(module_text(chart, saved=True, safe=safe), encoding="utf-8")
    printer = Printer({}, safe)
    operations = every_operation(chart)
    return {
        "file": str(file),
        "class": class_name(chart),
        "results": [
            [name, *([None, []] if one.result is None else _result(one.result, one.tried, printer))]
            for name, one in operations.items()
        ],
        "variables": _variables(chart),
        "script": [_line(chart, line, printer) for line in script_texts(script)],
    }


def _variables(chart: Chart) -> dict[str, object]:
    return {
        "own": [
            *(("data", variable.name) for variable in chart.data),
            *(("outputs", variable.name) for variable in chart.outputs),
        ],
        "invoked": [(one.id, _variables(one.chart)) for one in chart.invocations],
    }


def _line(chart: Chart, line: Text, printer: Printer) -> dict[str, object]:
    """Return a line of a script for the driver."""
    read = read_line(chart, line)
    found: dict[str, object] = {"verb": read.verb, "number": read.number}
    match read.verb:
        case "post" | "dispatch" | "ask" | "within":
            event = chart.events[read.event.event]
            pairs = zip(read.event.payload, event.fields, strict=True)
            found["event"] = event.name
            found["shown"] = event_text(chart, read.event)
            found["payload"] = [_value(value, part.type, printer) for value, part in pairs]
            found["reply"] = None
            if event.reply is not None:
                found["reply"] = "" if isinstance(event.reply, lang.SymbolType) else 0
        case "input":
            variable = chart.inputs[read.number]
            found["name"] = variable.name
            found["value"] = _value(read.value, variable.type, printer)
        case "returns":
            result = result_types(chart)[read.name]
            found["name"] = read.name
            found["payload"] = [_value(value, result, printer) for value in read.results]
        case "restore":
            found["data"] = read.data.hex()
        case "start" | "run" | "seed" | "dump" | "save":
            pass
        case verb:
            raise wrong_line(line, f"a machine in JavaScript has no line `{verb}`")
    return found


def _result(type_: lang.Type, listed: Sequence[lang.Value], printer: Printer) -> list[object]:
    """Return the type of a result, and the values of its ``from`` list."""
    return [_type(type_, printer), [_value(value, type_, printer) for value in listed]]


def _value(value: lang.Value, type_: lang.Type, printer: Printer) -> object:
    """Return a value as JSON that the driver reads."""
    match value:
        case tuple():
            assert isinstance(type_, lang.ArrayType | lang.RecordType)  # noqa: S101
            pairs = zip(value, part_types(type_), strict=True)
            return [_value(part, of, printer) for part, of in pairs]
        case bool() | str():
            return value
        case int() if printer.is_big(type_):
            return {"big": str(value)}
        case float() if not math.isfinite(value):
            return {"float": {"inf": "Infinity", "-inf": "-Infinity"}.get(repr(value), "NaN")}
        case _:
            return value


def _type(type_: lang.Type, printer: Printer) -> list[object]:
    """Return the type of a result for the host of the driver."""
    match type_:
        case lang.BoolType():
            return ["bool"]
        case lang.IntType(lo, hi):
            return ["int", str(lo), str(hi), printer.is_big(type_)]
        case lang.EnumType(numbers=numbers):
            return ["enum", *numbers]
        case lang.DurationType():
            return ["duration"]
        case lang.FloatType():
            return ["float"]
        case lang.SymbolType():
            return ["symbol"]
        case lang.ArrayType() | lang.RecordType():
            return ["parts", *(_type(part, printer) for part in part_types(type_))]
        case _:
            assert_never(type_)
