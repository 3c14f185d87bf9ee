"""Run extension modules by a script, for the differential test."""

from __future__ import annotations

import itertools
import tempfile
from collections.abc import Mapping, Sequence
from importlib.machinery import ExtensionFileLoader, ModuleSpec
from importlib.util import module_from_spec
from pathlib import Path
from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.codegen.c.compiler import QUICKEST
from fsmkit.codegen.c.limits import require_limits
from fsmkit.codegen.pyext.build import OPTIMIZED, build, suffix
from fsmkit.codegen.pyext.generate import LIBRARY, generate, source_name
from fsmkit.codegen.pyext.members import Module, module_of
from fsmkit.codegen.pyext.wrapper import (
    COVERING,
    ONCE,
    RECORDING,
    SAVING,
    machine_part,
    python_part,
)
from fsmkit.runtime.script import script_texts
from fsmkit.testing.harness.python import HarnessMachine, is_same

QUICK = ("-O0",)
NUMBERS = itertools.count()
"""Counter for module names: Python identifies an extension module by name and file."""


def run_many(pairs: Sequence[tuple[Chart, Sequence[str]]]) -> list[list[str]]:
    """Build all charts in one run of the compiler; return the trace of each script.

    A machine without a trace runs beside each; a difference is added to the trace. Raises
    `FsmkitError` for charts that cannot be expressed in C.
    """
    if not pairs:
        return []
    require_limits(chart for chart, _ in pairs)
    batch = next(NUMBERS)
    modules = [
        module_of(chart, f"{'t' if traced else 'u'}{batch}_{number}", traced=traced, saved=True)
        for number, (chart, _) in enumerate(pairs)
        for traced in (True, False)
    ]
    classes = _load(modules, f"batch_{batch}")
    return [
        _play(chart, script, classes[2 * number : 2 * number + 2])
        for number, (chart, script) in enumerate(pairs)
    ]


def load_class(
    chart: Chart,
    *,
    traced: bool = False,
    saved: bool = True,
    recorded: bool = False,
    prefix: str | None = None,
    covered: bool = False,
) -> type[Any]:
    """Return the class of a chart, built as it is shipped."""
    module, files = generate(
        chart, prefix, traced=traced, saved=saved, recorded=recorded, covered=covered
    )
    return _classes(files, source_name(module), [module], OPTIMIZED)[0]


def load_classes(
    charts: Sequence[Chart], *, covered: bool, optimize: str = "", is_built: bool = True
) -> list[type[Any]]:
    """Return the classes of several charts, built in one fast compilation.

    ``optimize``: the aim of the C code (`codegen.c.options`). Without ``is_built``, do everything
    but compile, to get its errors.
    """
    batch = next(NUMBERS)
    require_limits(charts)
    modules = [
        module_of(chart, f"n{batch}_{number}", saved=True, covered=covered, optimize=optimize)
        for number, chart in enumerate(charts)
    ]
    return _load(modules, f"batch_{batch}") if is_built and modules else []


def _play(chart: Chart, script: Sequence[str], classes: Sequence[type[Any]]) -> list[str]:
    driven = [HarnessExtension(chart, classes[0], traced=True)]
    driven.append(HarnessExtension(chart, classes[1], traced=False))
    for line in script_texts(script):
        is_same(driven, line)
    return driven[0].told


class HarnessExtension(HarnessMachine):
    """A machine that prints its data itself, if it has a trace."""

    def dump(self) -> None:
        """Add the data to the trace, if there is one."""
        if hasattr(self._machine, "trace"):
            self._machine._dump()  # noqa: SLF001  (for tests alone)

    def data(self) -> list[str]:
        """Return the data, a line each."""
        variables = self.family.names.variables.values()
        return [f"{name} {getattr(self._machine, name)!r}" for name in variables]


def _load(modules: Sequence[Module], name: str) -> list[type[Any]]:
    """Build one file that is several modules."""
    files = dict(LIBRARY)
    for module in modules:
        files |= module.machine.files
    recording = RECORDING if any(module.recorded for module in modules) else ""
    head = recording + ONCE + SAVING
    head += COVERING if any(module.covered for module in modules) else ""
    parts = [head, *map(machine_part, modules), '#include "fsm_python.h"\n']
    parts += map(python_part, modules)
    files[f"{name}.c"] = "\n".join(parts)
    return _classes(files, f"{name}.c", modules, QUICK)


def _classes(
    files: Mapping[str, str], source: str, modules: Sequence[Module], flags: Sequence[str]
) -> list[type[Any]]:
    candidates = {} if flags == OPTIMIZED else {"candidates": QUICKEST}
    made = build(files, source, Path(source).stem, flags, **candidates)
    with tempfile.TemporaryDirectory(prefix="fsmkit-") as folder:
        path = Path(folder) / f"{Path(source).stem}{suffix()}"
        path.write_bytes(made)
        return [_class(module, path) for module in modules]


def _class(module: Module, path: Path) -> type[Any]:
    loader = ExtensionFileLoader(module.name, str(path))
    loaded = module_from_spec(ModuleSpec(module.name, loader, origin=str(path)))
    loader.exec_module(loaded)
    found: type[Any] = getattr(loaded, module.bound.member.names.machine)
    return found
