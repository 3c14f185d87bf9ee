"""Stubs of the operations of an import: functions of the host, each with the foreign text."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from fsmkit.chart.chart import Chart
from fsmkit.codegen.target import Target
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.emit import c as in_c
from fsmkit.emit import python as in_python
from fsmkit.emit.python import source_name
from fsmkit.foreign.imports import OpaqueContent
from fsmkit.plugins import plugin

PROTOTYPES = re.compile(r"/\* Operations: the host defines them\. \*/\n((?:[^\n]+;\n)+)")
METHOD = re.compile(r"    def (\w+)\((self[^)]*)\) -> ([^:\n]+):\n        \"\"\"Operation `")
RESULTS = {"bool": "False", "None": "None"}


def write_stubs(chart: Chart, opaque: Iterable[OpaqueContent], language: str) -> dict[str, str]:
    """Return the file of stubs by name: ``lamp_host.c`` or ``lamp_host.py``.

    The functions have the signatures of the generated machine, so they compile with it.
    """
    findings = Findings()
    generated = plugin(Target, language).generate(chart, findings, {})
    if generated is None:
        raise FsmkitError(findings)
    texts = {one.name: one for one in opaque}
    named = [texts.get(each.name) for each in chart.operations]
    if language == "c":
        header = next(
            name
            for name in generated.files
            if name not in ("fsm.h", "fsm.c") and name.endswith(".h")
        )
        found = PROTOTYPES.search(generated.files[header])
        lines = [] if found is None else found[1].splitlines()
        pairs = zip(lines, named, strict=True)
        body = "".join(_c_function(line, one) for line, one in pairs)
        return {header.replace(".h", "_host.c"): f'#include "{header}"\n{body}'}
    module = next(name for name in generated.files if name.endswith(".py"))
    methods = METHOD.findall(generated.files[module])
    body = "".join(_method(each, one) for each, one in zip(methods, named, strict=True))
    text = f'"""Operations of the machine."""\n\n\nclass Host:\n    """The host."""\n\n{body}'
    return {module.replace(".py", "_host.py"): text}


def _note(one: OpaqueContent | None) -> str:
    if one is None:
        return "not opaque: written in the chart"
    source = one.text.span.source
    line, _ = source.position(one.text.span.start)
    return f"{source_name(source.name)}:{line}: {one.text.value}"


def _c_function(line: str, one: OpaqueContent | None) -> str:
    head = line.removesuffix(";")
    names = re.findall(r"(\w+)(?=[,)])", head)
    unused = "".join(f"    (void){name};\n" for name in names if name != "void")
    result = "" if head.startswith("void ") else "    return 0;\n"
    return f"\n/* {in_c.comment(_note(one))} */\n{head}\n{{\n{unused}{result}}}\n"


def _method(method: Sequence[str], one: OpaqueContent | None) -> str:
    name, parameters, result = method
    value = RESULTS.get(result.strip(), "0")
    return (
        f"    def {name}({parameters}) -> {result}:\n"
        f'        """{in_python.docstring(_note(one))}"""\n'
        f"        return {value}\n\n"
    )
