"""The example of a charger: it compiles without a warning, and errors in it are detected."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.chart.loading import load
from fsmkit.cli import execute
from fsmkit.codegen.target import Target
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.diagnostics.diagnostic import Diagnostic
from fsmkit.plugins import plugin
from fsmkit.verify.explore import check_file

ROOT = Path(__file__).parents[3]
EXAMPLE = ROOT / "fsmkit/cli/examples/charger"
WARNINGS = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow")
FOLDERS = ("-I.", "-Ivendor", "-Igenerated")
OURS = ("generated/charger.c", "generated/charger_bind.c")
WHOLE = (*OURS, "generated/fsm.c", "main.c", "vendor/bms.c", "vendor/hal_gpio.c")
PRINTED = """\
  0 ms:  0.0 A, relay on, level   0, rejected 0
100 ms:  0.0 A, relay on, level   0, rejected 0
200 ms:  0.0 A, relay on, level  50, rejected 0
300 ms: 32.0 A, relay on, level  50, rejected 0
400 ms: 32.0 A, relay on, level  50, rejected 0
500 ms: 16.0 A, relay on, level  50, rejected 0
600 ms:  0.0 A, relay off, level 100, rejected 0, charged
700 ms:  0.0 A, relay off, level 100, rejected 0, charged
"""
RequireTool = Callable[[str], str]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A copy of the example."""
    return shutil.copytree(EXAMPLE, tmp_path / "charger")


def compiled(folder: Path) -> dict[str, str]:
    """Write the machine of the chart with the binding beside it; return the files."""
    options = {"binding": str(folder / "charger.c.yaml")}
    findings = Findings()
    made = plugin(Target, "c").generate(load(folder / "charger.yaml"), findings, options)
    if made is None:
        raise FsmkitError(findings)
    out = folder / "generated"
    out.mkdir(exist_ok=True)
    for name, text in made.files.items():
        (out / name).write_text(text, encoding="utf-8")
    return dict(made.files)


def build(folder: Path, compiler: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [compiler, *WARNINGS, "-Werror", *FOLDERS, *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.cc
@pytest.mark.parametrize("compiler", ["cc", pytest.param("clang", marks=pytest.mark.external)])
def test_it_compiles_without_a_warning_and_charges(
    compiler: str, folder: Path, require_tool: RequireTool
) -> None:
    compiled(folder)
    done = build(folder, require_tool(compiler), *WHOLE, "-o", "charger")
    assert (done.returncode, done.stderr) == (0, "")
    ran = subprocess.run([folder / "charger"], capture_output=True, text=True, check=True)
    assert ran.stdout == PRINTED


@pytest.mark.cc
def test_without_the_vendor_it_compiles_unbound(folder: Path, require_tool: RequireTool) -> None:
    compiled(folder)
    shutil.rmtree(folder / "vendor")
    cc = require_tool("cc")
    done = build(folder, cc, "-fsyntax-only", "-DFSM_UNBOUND", OURS[0])
    assert (done.returncode, done.stderr) == (0, "")
    assert build(folder, cc, "-fsyntax-only", OURS[0]).returncode != 0


def test_the_machine_is_the_same_text_bound_or_not(folder: Path) -> None:
    bound = compiled(folder)
    alone = plugin(Target, "c").generate(load(folder / "charger.yaml"), Findings(), {})
    assert alone is not None
    differing = {name for name in bound if bound[name] != alone.files.get(name)}
    assert differing == {"charger.h", "charger_bind.h", "charger_bind.c"}


@pytest.mark.cc
def test_the_explorer_needs_no_file_of_the_vendor(folder: Path) -> None:
    shutil.rmtree(folder / "vendor")
    (folder / "board.h").unlink()
    found = check_file(folder / "charger.yaml", Findings())
    assert found[1].verdict.value == "holds"


def test_the_binding_is_checked_alone(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["check", str(folder / "charger.c.yaml")]) == 0
    assert "constants 2, types 2, operations 4, sends 2, inputs 3, outputs 2" in (
        capsys.readouterr().out.replace("\n", " ")
    )


def test_the_binding_can_be_left_out_or_named(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    chart, out = str(folder / "charger.yaml"), folder / "out"
    assert execute(["compile", chart, "--out", str(out), "--binding", "none"]) == 0
    assert not (out / "charger_bind.c").exists()
    (folder / "charger.c.yaml").rename(folder / "desk.c.yaml")
    named = str(folder / "desk.c.yaml")
    assert execute(["compile", chart, "--out", str(out), "--binding", named]) == 0
    assert (out / "charger_bind.c").exists()
    assert execute(["compile", chart, "--target", "python", "--binding", named]) == 2
    assert execute(["compile", named]) == 1
    assert "binds a chart to C" in capsys.readouterr().err


def test_a_chart_that_is_bound_late_is_a_chart(tmp_path: Path) -> None:
    base, own = tmp_path / "base.yaml", tmp_path / "own.yaml"
    base.write_text("chart: Base\ninitial: a\nstates: {a: {}}\n")
    own.write_text("chart: Own\nextends: base.yaml\nbinding: late\n")
    assert execute(["compile", str(own), "--out", str(tmp_path / "out")]) == 0


MUTANTS = [
    # constants
    ("vendor/bms.h", "BMS_AMPS_MAX 320u", "BMS_AMPS_MAX 321u"),
    ("vendor/bms.h", "BMS_AMPS_MAX 320u", "BMS_AMPS_MAX (-320)"),
    ("vendor/bms.h", "BMS_AMPS_MAX 320u", "BMS_AMPS_MAX 4294967616u"),
    ("vendor/bms.h", "BMS_AMPS_MAX 320u", "BMS_AMPS_MAX limit()"),
    ("vendor/bms.h", "BMS_AMPS_MAX 320u", 'BMS_AMPS_MAX "320"'),
    ("vendor/bms.h", "BMS_AMPS_MAX 320u", "BMS_AMPS 320u"),
    ("vendor/bms.h", "DC (450)", "DC (45.0)"),
    ("vendor/bms.h", "DC (450)", "DC"),
    ("charger.c.yaml", "AMPS_MAX: BMS_AMPS_MAX", "AMPS_MAX: BMS_TEMP_MAX_DC"),
    ("charger.c.yaml", "AMPS_MAX: BMS_AMPS_MAX", "AMPS_MOST: BMS_AMPS_MAX"),
    ("charger.yaml", "AMPS_MAX: 320", "AMPS_MAX: 319"),
    ("charger.yaml", "TEMP_MAX: 450", "TEMP_MAX: -450"),
    # members
    ("vendor/bms.h", "{ BMS_OK, BMS_HOT, BMS_LOST }", "{ BMS_OK, BMS_LOST, BMS_HOT }"),
    ("vendor/bms.h", "{ BMS_OK, BMS_HOT, BMS_LOST }", "{ BMS_OK, BMS_HOT = 2, BMS_LOST }"),
    ("vendor/bms.h", "{ BMS_OK, BMS_HOT, BMS_LOST }", "{ BMS_OK, BMS_HOT, BMS_GONE }"),
    ("vendor/bms.h", "{ BMS_OK, BMS_HOT, BMS_LOST }", "{ BMS_OK = -1, BMS_HOT = 1, BMS_LOST }"),
    ("vendor/bms.h", "} bms_status;", "} bms_state_type;"),
    ("charger.c.yaml", "hot: BMS_HOT, lost: BMS_LOST", "hot: BMS_LOST, lost: BMS_HOT"),
    ("charger.c.yaml", "hot: BMS_HOT, lost: BMS_LOST", "hot: BMS_HOT, lost: BMS_HOT"),
    ("charger.c.yaml", "hot: BMS_HOT, lost: BMS_LOST", "hot: BMS_HOT"),
    ("charger.c.yaml", "hot: BMS_HOT", "warm: BMS_HOT"),
    ("charger.yaml", "[none, hot, lost]", "[none, lost, hot]"),
    ("charger.yaml", "[none, hot, lost]", "[none, hot, cold, lost]"),
    # fields
    ("vendor/bms.h", "temp_dc;", "temp;"),
    ("vendor/bms.h", "int16_t temp_dc;", "int8_t temp_dc;"),
    ("vendor/bms.h", "int16_t temp_dc;", "int16_t *temp_dc;"),
    ("vendor/bms.h", "int16_t temp_dc;", "float temp_dc;"),
    ("vendor/bms.h", "amps : 10;", "amps : 8;"),
    ("vendor/bms.h", "} bms_frame;", "} bms_sample;"),
    ("charger.c.yaml", "temp: temp_dc}", "temp: temp_c}"),
    ("charger.c.yaml", "temp: temp_dc}", "temp: amps}"),
    ("charger.c.yaml", "amps: amps, temp: temp_dc", "temp: temp_dc"),
    ("charger.c.yaml", "ctx->pwm.level", "ctx->pwm.duty"),
    ("charger.c.yaml", "ctx->frame.temp_dc", "ctx->frames.temp_dc"),
    ("charger.c.yaml", "member: machine", "member: frame"),
    ("charger.c.yaml", "member: machine", "member: charger"),
    # arguments
    ("vendor/bms.h", "void bms_set(bms_channel channel, float amps)",
     "void bms_set(float amps, bms_channel channel)"),
    ("vendor/bms.h", "void bms_set(bms_channel channel, float amps)",
     "void bms_set(bms_channel channel, uint8_t amps)"),
    ("vendor/bms.h", "void bms_set(bms_channel channel, float amps)",
     "void bms_set(bms_channel channel, const float *amps)"),
    ("vendor/bms.h", "void bms_set(bms_channel channel, float amps)",
     "void bms_set(bms_channel channel)"),
    ("vendor/bms.h", "bms_status bms_state(", "bms_channel bms_state("),
    ("vendor/bms.h", "bms_status bms_state(", "float bms_state("),
    ("vendor/hal_gpio.h", "GPIO_PinState state);", "bms_status state);"),
    ("board.h", "void board_notify(struct board *board,", "void board_notify(bms_frame *board,"),
    ("board.h", "void board_show(struct board *board, bms_status fault)",
     "void board_show(struct board *board, bms_status *fault)"),
    ("board.h", "uint8_t level;", "uint8_t *level;"),
    ("charger.c.yaml", "(float)amps / 10.0f", "(float)amp / 10.0f"),
    ("charger.c.yaml", "(float)amps / 10.0f", "amps / 10.0"),
    ("charger.c.yaml", "ctx->last = sample", "ctx->last = amps"),
    ("charger.yaml", "set_current(amps 0..320)", "set_current(milliamps 0..320)"),
]  # fmt: skip
"""A text of a file, and one that is wrong: of the vendor, the host, the binding or the chart."""
SILENT = ("vendor/bms.h", "void bms_set(float amps, bms_channel channel)")
"""C makes a fraction a member of an enumeration, and neither gcc nor clang warns."""


@pytest.mark.slow
@pytest.mark.cc
def test_what_is_wrong_is_a_finding_or_does_not_compile(
    folder: Path, require_tool: RequireTool
) -> None:
    cc = require_tool("cc")
    lived: list[tuple[str, str]] = []
    told: list[Diagnostic] = []
    for file, old, new in MUTANTS:
        path = folder / file
        text = path.read_text(encoding="utf-8")
        assert old in text, old
        path.write_text(text.replace(old, new), encoding="utf-8")
        try:
            compiled(folder)
        except FsmkitError as error:
            told += error.diagnostics
        else:
            done = build(folder, cc, "-fsyntax-only", *OURS)
            if done.returncode == 0:
                lived.append((file, new))
        path.write_text(text, encoding="utf-8")
    assert lived == [SILENT]
    assert all(each.primary is not None and each.help for each in told)
    assert len(MUTANTS) >= 40
