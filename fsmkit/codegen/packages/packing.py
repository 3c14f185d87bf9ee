"""Packages for embedded builds: source folders, manifests, and an example that compiles.

Sources: the library specification of Arduino (1.5 format), ``library.json`` of PlatformIO, the
build system and the component manifest of ESP-IDF, the modules of Zephyr. All names use the
machine's prefix, an identifier in lower case, so manifests contain no text of a chart.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from fsmkit.chart.analysis.host_events import sent_events
from fsmkit.codegen.c.expressions.types import parameter_type
from fsmkit.codegen.c.header import parameters
from fsmkit.codegen.c.names import Names
from fsmkit.diagnostics import fail
from fsmkit.emit import Emitter, version
from fsmkit.emit.template import Fields, filled
from fsmkit.language import Field, RecordType, Type

TEMPLATES = Path(__file__).parent / "templates"
"""A folder for each kind of package; ``@`` in a path is replaced by the prefix."""
MACHINE = TEMPLATES / "machine.c"
"""The common part of all examples: the machine and its clock."""
VERSION = "0.1.0"
"""The version of the library, which its publisher replaces."""
URL = "https://example.org"
"""The address of the library, which its publisher replaces."""
CLOCKS = {
    "arduino": "(uint32_t)micros()",
    "platformio": "(uint32_t)micros()",
    "esp-idf": "(uint32_t)esp_timer_get_time()",
    "zephyr": "(uint32_t)k_ticks_to_us_floor64((uint64_t)k_uptime_ticks())",
}
"""For each environment, an expression of type ``uint32_t`` for its clock in us, which may wrap."""
TAKEN = frozenset({"setup", "loop", "app_main"})
"""Functions that the environments call."""


def packed(kind: str, names: Names, files: Mapping[str, str]) -> dict[str, str]:
    """Return the files of a package; sources are in ``src``.

    Raises:
        FsmkitError: ``wrong-option``, if the environment reserves the prefix.

    """
    p = names.prefix
    if p in TAKEN:
        raise fail(
            "wrong-option",
            f"a program of this build has a function `{p}` already: it cannot be a prefix",
            help=f"use another: `--prefix {p}_machine`",
        )
    found = {f"src/{path}": text for path, text in files.items()}
    sources = sorted(path for path in found if path.endswith(".c"))
    fields: Fields = {
        "version": VERSION,
        "fsmkit": version.VERSION,
        "url": URL,
        "option": f"FSM_{p.upper()}",  # Zephyr has options of its own: GPIO, ADC
        "sources": "\n  ".join(sources),
        "quoted_sources": " ".join(f'"{source}"' for source in sources),
        **_example(names, CLOCKS[kind]),
    }
    folder = TEMPLATES / kind
    for file in sorted(path for path in folder.rglob("*") if path.is_file()):
        name = file.relative_to(folder).as_posix().replace("@", p)
        found[name] = filled(file.read_text(encoding="utf-8"), fields)
    return found


def _example(names: Names, clock: str) -> Fields:
    """Return the template fields of a host that runs the machine and has empty operations."""
    p, chart = names.prefix, names.chart
    out = Emitter()
    for operation in chart.operations:
        name = names.operations[operation.name]
        stub(out, names, name, operation.parameters, operation.result)
    for event in (chart.events[index] for index in sent_events(chart)):
        stub(out, names, f"send_{names.event_names[event.index]}", event.fields, None)
    stubs = out.finish()
    it = "machine" if p != "machine" else "machine_"
    fields: Fields = {"prefix": p, "upper": names.upper, "machine": it, "microseconds": clock}
    runs = [f"{p}_run(&{it}, now());"] if names.does.runs else []
    return {
        **fields,
        "declarations": filled(MACHINE.read_text(encoding="utf-8"), fields),
        "stubs": f"{stubs}\n" if stubs else "",
        "start": [f"{p}_init(&{it});", f"{p}_start(&{it}, now());"],
        "loop": ["/* post events and set inputs here */", *runs],
    }


def stub(
    out: Emitter, names: Names, name: str, fields: tuple[Field, ...], result: Type | None
) -> None:
    """Print an empty function of the host."""
    p = names.prefix
    ctype = "void" if result is None else parameter_type(result, names)
    out.line(f"{ctype} {p}_{name}({p} *m{parameters(fields, names)})")
    with out.block("{"):
        out.line("(void)m;")
        out.lines(f"(void){names.field(part.name)};" for part in fields)
        if isinstance(result, RecordType):
            out.lines([f"static {ctype} nothing;", "return nothing;"])
        elif result is not None:
            out.line(f"return ({ctype})0;")
    out.line()
