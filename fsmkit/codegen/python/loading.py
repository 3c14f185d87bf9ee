"""Generated modules, loaded without a file."""

from __future__ import annotations

from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.codegen.python.family import family_of
from fsmkit.codegen.python.generate import module_text


def load_machine(
    chart: Chart,
    *,
    traced: bool = False,
    saved: bool = True,
    recorded: bool = False,
    covered: bool = False,
) -> type[Any]:
    """Return the generated class of a chart; the options are those of `module_text`."""
    machine = family_of(chart).names.machine
    space: dict[str, Any] = {"__name__": f"fsmkit_generated_{machine}"}
    text = module_text(chart, traced=traced, saved=saved, recorded=recorded, covered=covered)
    code = compile(text, f"<{chart.name}.py>", "exec", dont_inherit=True)
    exec(code, space)  # noqa: S102  (the text is our own)
    found: type[Any] = space[machine]
    return found
