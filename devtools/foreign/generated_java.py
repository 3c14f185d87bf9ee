"""Comparing machines of Rhapsody with the Java that Rhapsody generated from them.

A copy of the Java is compiled with a stand-in of Rhapsody's framework (``framework.java``). In the
copy, content that is opaque in the import calls the driver, as the chart calls its host. States,
transitions and translated content stay as Rhapsody generated them.
"""

from __future__ import annotations

import re
import shlex
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.document.document import Direction
from fsmkit.foreign.imports import Import, Role
from fsmkit.foreign.rhapsody.plugin import PLUGIN
from fsmkit.foreign.rhapsody.reader import SENT
from fsmkit.runtime.session import Session
from fsmkit.testing.foreign.proof import compare_with_c, compare_with_program

FRAMEWORK = Path(__file__).with_name("framework.java")
FILE = re.compile(r"^// file (\S+)/(\w+)\n", re.MULTILINE)
CONTENT = re.compile(r"//#\[ (?:transition|state) .*?//#\]", re.DOTALL)
"""Content of a transition or state in generated Java."""
GUARD = re.compile(r"(?<=//## transition )\d+\s+if\(.*?\)\n", re.DOTALL)
"""A guard in generated Java, after the number of its transition."""
DISPATCHED = re.compile(r"\bint \w+_takeEvent\(short")


@dataclass(frozen=True, slots=True)
class Generated:
    """A class in a unit of Rhapsody, and the Java that was generated from it."""

    unit: Path
    machine: str
    java: Path


def generated_classes(folder: Path) -> Iterator[Generated]:
    """Yield the machines below a folder whose generated Java handles events."""
    for project in sorted(folder.rglob("*.rpy")):
        java = {path.stem: path for path in sorted(project.parent.rglob("*.java"))}
        for unit in sorted((*project.parent.rglob("*.sbs"), *project.parent.rglob("*.cls"))):
            source = PLUGIN.decode(unit.read_bytes(), str(unit), Findings())
            for machine in () if source is None else PLUGIN.machines(source, Findings()):
                path = java.get(machine)
                if path is not None and DISPATCHED.search(path.read_text(errors="replace")):
                    yield Generated(unit, machine, path)


def comparison(one: Generated, events: int, folder: Path) -> str:
    """Return the verdict on one class; ``folder`` is for compiled files."""
    findings = Findings()
    source = PLUGIN.decode(one.unit.read_bytes(), str(one.unit), findings)
    found = None if source is None else PLUGIN.import_machine(source, one.machine, findings)
    chart = None if found is None else elaborate((found.document,), findings)
    findings.stop_on_errors()
    if found is None or chart is None:
        return "no chart"
    silent = {each.name: lambda *_: None for each in chart.operations if each.result is None}
    if not any(each.result for each in chart.operations) and Session(chart, silent).fault:
        return "no difference: neither comes to rest"
    try:
        command = compiled(one, found, chart, folder)
        difference = compare_with_program(chart, command, events) or compare_with_c(chart, events)
    except (FsmkitError, LookupError) as error:
        return f"not compared: {error}"
    return "no difference" if difference is None else "\n".join(difference.lines())


def compiled(one: Generated, found: Import, chart: Chart, folder: Path) -> str:
    """Compile the Java of a package; return the command that runs one of its machines."""
    for path, text in (*framework(), *_package(one.java, found)):
        file = folder / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    events = (event.name for event in chart.events if Direction.IN in event.directions)
    package = one.java.parent.name
    needed = ["harness/Driver", *(f"{package}/{name}" for name in (one.machine, *events))]
    done = subprocess.run(
        ["javac", "-nowarn", "-encoding", "UTF-8", "-sourcepath", str(folder), "-d", str(folder),
         *(str(folder / f"{name}.java") for name in needed)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        raise LookupError(done.stderr)
    names = [state.id for state in chart.states if state.is_leaf]
    type_ = f"{package}.{one.machine}"
    return shlex.join(["java", "-Xshare:auto", "-cp", str(folder), "harness.Driver", type_, *names])


def framework() -> Iterator[tuple[str, str]]:
    """Yield the files of the stand-in: the path and the text."""
    _, *parts = FILE.split(FRAMEWORK.read_text())
    for package, name, text in zip(parts[::3], parts[1::3], parts[2::3], strict=True):
        yield f"{package}/{name}.java", f"package {package.replace('/', '.')};\n{text}"


def _package(java: Path, found: Import) -> Iterator[tuple[str, str]]:
    for path in sorted(java.parent.glob("*.java")):
        text = path.read_text(errors="replace")
        yield f"{java.parent.name}/{path.name}", (with_host(text, found) if path == java else text)


def with_host(java: str, found: Import) -> str:
    """Return generated Java whose opaque content calls the driver."""
    missing = {one.name for one in found.opaque}

    def change(section: str, role: Role) -> str:
        changed: list[str] = []

        def mark(code: str) -> str:
            changed.append(code)
            return f"\0{len(changed) - 1}\0"

        for one in sorted(found.opaque, key=lambda one: -len(one.text.value)):
            call = f'harness.Host.{"guard" if role is Role.GUARD else "act"}("{one.name}")'
            words = r"\s+".join(map(re.escape, one.text.value.rstrip(";").split()))
            pattern = re.compile(rf"(?<![\w.]){words}(?=\s*[;)&|])")
            if one.role is role and pattern.search(section):
                missing.discard(one.name)
                section = pattern.sub(lambda _, call=call: mark(call), section)  # type: ignore[misc]
        section = SENT.sub(
            lambda sent: mark(f'harness.Host.send("{sent["java"]}", "{sent["event"]}")'), section
        )
        return re.sub(r"\0(\d+)\0", lambda number: changed[int(number[1])], section)

    java = CONTENT.sub(lambda section: change(section[0], Role.ACTION), java)
    java = GUARD.sub(lambda section: change(section[0], Role.GUARD), java)
    if missing:
        raise LookupError(f"the Java has not the content of {', '.join(sorted(missing))}")
    return java
