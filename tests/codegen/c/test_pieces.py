"""The shared pieces of C compile unchanged, and use only existing mechanisms."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

from fsmkit.chart.loading import load
from fsmkit.codegen.c.ir import OWN, Unit, reachable, resolve_prefixes
from fsmkit.codegen.c.naming import name_everything
from fsmkit.codegen.c.pieces import FOLDER
from fsmkit.plan import lower
from fsmkit.runtime.library import C_LIBRARY

HERE = Path(__file__).parent
STEPS = ("queue", "content", "timers", "selection", "loop", "invocation")
SELECT = ("select_event", "select_eventless", "select_event_0", "select_eventless_0")
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")
LOOPING = frozenset(
    {"QUEUED", "RUNS", "POLLS", "LOOPS", "STOPS", "RAISES", "BEGINS", "RESTS", "SETTLES"}
)


@pytest.fixture(scope="module")
def facts(tmp_path_factory: pytest.TempPathFactory) -> frozenset[str]:
    """Return the names that a condition may use."""
    path = tmp_path_factory.mktemp("facts") / "any.yaml"
    path.write_text("chart: Any\nstates: {a: {}}\n", encoding="utf-8")
    return frozenset(name_everything(lower(load(path)), None).facts)


@pytest.mark.cc
@pytest.mark.parametrize("kind", ["MANY", "SINGLE", "PLAIN"])
@pytest.mark.parametrize("much", ["none", "looping", "all"])
def test_a_compiler_takes_the_pieces_as_they_are(
    facts: frozenset[str], kind: str, much: str, tmp_path: Path
) -> None:
    kinds = {"MANY": set[str](), "SINGLE": {"SINGLE"}, "PLAIN": {"SINGLE", "PLAIN"}}[kind]
    mechanisms = {"none": frozenset[str](), "looping": LOOPING, "all": facts - {"SINGLE", "PLAIN"}}
    so = mechanisms[much] | kinds
    lines = ['#include "pieces.h"']
    lines += [f'#include "{name}.c"' for name in STEPS if kind != "PLAIN"]
    lines += [f"#undef self_{name}" for name in SELECT]
    lines += ['#include "tables.c"']
    source = tmp_path / "pieces.c"
    source.write_text("\n".join([*lines, ""]), encoding="utf-8")
    command = ["gcc", "-std=c99", *WARNINGS, "-Wno-unused-function", "-Wno-unused-variable"]
    command += ["-fsyntax-only", f"-I{HERE}", f"-I{FOLDER}", f"-I{C_LIBRARY}"]
    command += [f"-D{name}=1" for name in so]
    done = subprocess.run([*command, str(source)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_conditions_ask_for_what_is_known_of_machines(facts: frozenset[str]) -> None:
    for path in FOLDER.glob("*.c"):
        text = path.read_text(encoding="utf-8")
        conditions = re.findall(r"^#(?:el)?if (.*)$", text, re.MULTILINE)
        asked = set(re.findall(r"\w+", " ".join(conditions)))
        assert asked <= facts, path.name


def test_what_nothing_reaches_is_left_out() -> None:
    unit = Unit()
    for name, uses in (("a", "b"), ("b", "a"), ("c", "d"), ("d", "d"), ("e", "c")):
        unit.define(name)
        unit.lines([f"static void {OWN}_{name}(void) {{ {OWN}_{uses}(); }}", ""])
    unit.define()
    unit.line(f"void {OWN}_start(void) {{ {OWN}_c(); }}")
    assert resolve_prefixes(reachable(unit.definitions()), "m", "M") == (
        "static void m_c(void) { m_d(); }\n\n"
        "static void m_d(void) { m_d(); }\n\n"
        "void m_start(void) { m_c(); }\n"
    )
