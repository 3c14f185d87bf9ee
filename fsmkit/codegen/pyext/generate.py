"""An extension module as files: the machine in C, the wrapper, the types."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.codegen.pyext.definitions import stub_text
from fsmkit.codegen.pyext.members import Module, module_of
from fsmkit.codegen.pyext.wrapper import wrapper_text

LIBRARY = {
    name: (Path(__file__).parent / name).read_text(encoding="utf-8")
    for name in ("fsm_python.h", "fsm_python_hooks.h")
}
"""Texts that all modules share."""


def source_name(module: Module) -> str:
    """Return the name of the one file that is compiled."""
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
    wrapper = wrapper_text(module)
    files = {f"{module.name}.pyi": stub_text(module), source_name(module): wrapper}
    return module, files | _included(wrapper, {**module.machine.files, **LIBRARY})


def _included(text: str, files: Mapping[str, str]) -> dict[str, str]:
    """Return the files that a text includes, directly or not."""
    found: dict[str, str] = {}
    waiting = [text]
    while waiting:
        for name in re.findall(r'^#include "(.+)"', waiting.pop(), re.MULTILINE):
            if name in files and name not in found:
                found[name] = files[name]
                waiting.append(files[name])
    return found
