"""An extension module as files: the machine in C, the wrapper, the types."""

from __future__ import annotations

from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.codegen.pyext.definitions import stub_text
from fsmkit.codegen.pyext.members import Module, module_of
from fsmkit.codegen.pyext.wrapper import wrapper_text

LIBRARY = {
    name: (Path(__file__).parent / name).read_text(encoding="utf-8")
    for name in ("fsm_python.h", "fsm_python_hooks.h")
}
"""The texts that all modules share."""


def source_name(module: Module) -> str:
    """Return the name of the compiled file, which includes the others."""
    return f"{module.name}_python.c"


def generate(
    chart: Chart,
    prefix: str | None = None,
    *,
    traced: bool = False,
    saved: bool = False,
    recorded: bool = False,
    covered: bool = False,
) -> tuple[Module, dict[str, str]]:
    """Return a module and its texts by file name; ``prefix`` names module and class."""
    module = module_of(
        chart, prefix, traced=traced, saved=saved, recorded=recorded, covered=covered
    )
    files = {f"{module.name}.pyi": stub_text(module), source_name(module): wrapper_text(module)}
    inside = f"{module.machine.names.prefix}_records.c"  # part of the wrapper
    rest = {name: text for name, text in module.machine.files.items() if name != inside}
    return module, files | rest | LIBRARY
