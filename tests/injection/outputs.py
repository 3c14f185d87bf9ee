"""Every output of fsmkit, made as people make it."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from devtools.endurance.program import program, report_limits
from fsmkit.chart.loading import load
from fsmkit.cli import execute as command_line
from fsmkit.diagnostics import Findings
from tests.injection.debugging import debugged
from tests.injection.judges import (
    Made,
    Refused,
    compiled,
    is_aut,
    is_c,
    is_chart,
    is_checked,
    is_cspm,
    is_dot,
    is_drawn,
    is_extension,
    is_fmu,
    is_jani,
    is_javascript,
    is_json,
    is_linked,
    is_package,
    is_page,
    is_promela,
    is_recorded,
    is_sarif,
    is_tested,
    is_text,
    is_uppaal,
    no_code,
    runs,
)


@dataclass(frozen=True, slots=True)
class Output:
    """A command (``OUT`` is a folder), and what reads what it wrote.

    ``before``: another command, which writes into the same folder first. ``by``: what makes and
    judges the output where no command does: of a file and a folder, whether anything was made.
    """

    name: str
    arguments: tuple[str, ...]
    judge: Callable[[Made], None]
    shapes: tuple[str, ...]
    is_quick: bool = True
    before: tuple[str, ...] = ()
    by: Callable[[Path, Path], bool] | None = None


def made(output: Output, file: Path, folder: Path) -> Made:
    """Run the command on a file."""
    folder.mkdir()
    out, errors, code = io.StringIO(), io.StringIO(), 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(errors):
        for arguments in filter(None, (output.before, output.arguments)):
            words = [w.replace("OUT", str(folder)) for w in arguments]
            code = command_line([w.replace("FILE", str(file)) for w in words])
            if code != 0:
                break
    return Made(code, out.getvalue(), errors.getvalue(), folder)


def judge(output: Output, file: Path, folder: Path) -> bool:
    """Whether anything was written; fails if it is wrong, and where fsmkit breaks."""
    if output.by is not None:
        return output.by(file, folder)
    found = made(output, file, folder)
    assert found.code in (0, 1), f"exit code {found.code}: {found.errors[-2000:]}"
    assert "Traceback" not in found.errors, found.errors
    assert "time limit" not in found.errors, found.errors
    assert "explorer-build" not in found.errors + found.printed, found.errors + found.printed
    if found.code == 1 and output.arguments[0] != "check":
        assert found.errors.strip(), "refused without a finding"
        return False
    try:
        output.judge(found)
    except Refused:
        return False
    return True


def endures(file: Path, folder: Path) -> bool:
    """Write the program of endurance; whether it can be. It compiles."""
    chart, findings = load(file), Findings()
    report_limits(chart, findings)
    if findings.has_errors:
        return False
    folder.mkdir()
    for name, text in program(chart).items():
        no_code(text)
        (folder / name).write_text(text, encoding="utf-8")
    more = ("-Wno-type-limits", "-Wno-unused-function")
    compiled(
        [str(folder / "main.c")],
        [*more, f"-I{folder}"],
        ("-fsyntax-only", "-Wall", "-Wextra", "-Werror"),
    )
    return True


CHARTS = ("yaml", "scxml", "invoking")
CLOSED = (*CHARTS, "system")
WRITTEN = ("yaml", "scxml")
TESTABLE = (*WRITTEN, "system")
DRAWN = [word for end in ("svg", "mmd", "puml") for word in ("--draw", f"OUT/d.{end}")]
MACHINES = ("compile", "FILE", "--out", "OUT/m")


def _compile(name: str, *more: str) -> tuple[str, ...]:
    return ("compile", "FILE", "--target", name, "--out", "OUT", *more)


def _export(kind: str, end: str) -> tuple[str, ...]:
    bounded = ("--max-states", "20000", "--timeout", "300s")
    return ("export", "FILE", "--to", kind, "--out", f"OUT/x.{end}", *bounded)


def _check(*more: str) -> tuple[str, ...]:
    return ("check", "FILE", "--timeout", "300s", *more)


def _convert(kind: str) -> tuple[str, ...]:
    return ("convert", "FILE", "--to", kind, "--out", f"OUT/x.{kind}")


OUTPUTS = (
    Output("c", _compile("c"), is_c, CHARTS),
    Output("c with all", _compile("c", "--with", "save,trace"), is_c, CHARTS),
    Output("c recorded", _compile("c", "--with", "save,records"), is_recorded, CHARTS),
    Output("c size", _compile("c", "--optimize", "size"), is_c, CHARTS),
    Output("c of a system", ("compile", "FILE", "--out", "OUT"), is_c, ("system",)),
    Output("deployment", ("compile", "FILE", "--out", "OUT"), is_linked, ("deployment",)),
    Output("python of a deployment", _compile("python"), runs, ("system", "deployment")),
    Output("python", _compile("python"), runs, CHARTS),
    Output(
        "python with all", _compile("python", "--trace", "--with", "save,records"), runs, CHARTS
    ),
    Output("pyext", _compile("pyext", "--no-build"), is_extension, CHARTS),
    Output(
        "pyext recorded", _compile("pyext", "--no-build", "--trace", "--with", "save,records"),
        is_extension, CHARTS, is_quick=False,
    ),
    Output("package", (*MACHINES[:2], "--package", "esp-idf", "--out", "OUT"), is_package, WRITTEN),
    Output("fmu", _compile("fmu", "--no-build"), is_fmu, WRITTEN),
    Output("fmu of 2.0", _compile("fmu", "--no-build", "--fmi", "2.0"), is_fmu, WRITTEN),
    Output("javascript", _compile("javascript"), is_javascript, CHARTS),
    Output("javascript with all", _compile("javascript", "--with", "save"), is_javascript, CHARTS),
    Output("page", ("simulate", "FILE", "--out", "OUT/x.html"), is_page, CLOSED),
    Output("transitions", _compile("transitions"), runs, ("plain",)),
    *(
        Output(f"draw {end}", ("draw", "FILE", "--out", f"OUT/x.{end}"), is_drawn, CHARTS)
        for end in ("dot", "svg", "mmd", "puml")
    ),
    Output("aut", _export("aut", "aut"), is_aut, CLOSED),
    Output("cspm", _export("cspm", "csp"), is_cspm, CLOSED),
    Output("export dot", _export("dot", "dot"), is_dot, CLOSED),
    Output("jani", _export("jani", "jani"), is_jani, CLOSED),
    Output("promela", _export("promela", "pml"), is_promela, CLOSED),
    Output("uppaal", _export("uppaal", "xml"), is_uppaal, TESTABLE),
    Output("uppaal flat", _export("uppaal-flat", "xml"), is_uppaal, TESTABLE),
    Output("to scxml", _convert("scxml"), is_chart, WRITTEN),
    Output("to yaml", _convert("yaml"), is_chart, WRITTEN),
    Output("show", ("show", "FILE"), is_text, CLOSED),
    Output("show json", ("show", "FILE", "--json"), is_json, CLOSED),
    Output("run", ("run", "FILE", "--events", "go; wait 2s"), is_text, CHARTS),
    Output("run json", ("run", "FILE", "--events", "go; wait 2s", "--json"), is_json, CHARTS),
    Output("sarif", ("show", "FILE", "--sarif", "OUT/x.sarif"), is_sarif, CLOSED),
    Output(
        "check", _check("--json", "--save-trace", "OUT/t", *DRAWN), is_checked, CLOSED,
        is_quick=False,
    ),
    Output(
        "test in python", _check("--json", "--save-test", "OUT/t.py"), is_checked, TESTABLE,
        is_quick=False,
    ),
    Output("check text", _check("--time", "untimed"), is_text, CLOSED, is_quick=False),
    Output(
        "test in c", _check("--save-test", "OUT/t.c"), is_tested, TESTABLE,
        is_quick=False, before=MACHINES,
    ),
    Output(
        "cover", ("cover", "FILE", "--timeout", "300s", "--json", "--out", "OUT/c"),
        is_tested, WRITTEN,
        is_quick=False, before=MACHINES,
    ),
    Output("endurance", (), is_c, ("plain",), by=endures),
    Output("dap", (), is_json, (*CLOSED, "plain", "deployment"), by=debugged),
)  # fmt: skip
