"""Generated C in the hands of a host that does all that it must not; see `misuse.c`."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.chart.loading import load
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.c.options import Options
from tests.misuse.conftest import ABUSED, EVENTS, HERE, IS_LONG

pytestmark = pytest.mark.external

ROOT = HERE.parents[1]
HOSTS = ROOT / "fsmkit/runtime/c/hosts"
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")
SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")
FORMS = {
    "default": Options(),
    "size": Options(is_small=True),
    "tables": Options(is_small=True, is_tabled=True),
}
SEED = "7"


def run_program(
    folder: Path, options: Options, compiler: str, arguments: tuple[str, ...], *words: str
) -> str:
    """Generate the machine, compile it with a program, and return the output of the program."""
    machine = generate_machine(load(ABUSED), "abused", options)
    for name, text in machine.files.items():
        (folder / name).write_text(text, encoding="utf-8")
    sources = [*map(str, sorted(folder.glob("*.c"))), *arguments]
    command = [compiler, *STRICT, "-O1", "-g", f"-I{folder}", *sources, "-o", f"{folder}/program"]
    subprocess.run(command, check=True)
    done = subprocess.run([folder / "program", *words], capture_output=True, text=True, check=False)
    sys.stdout.write(done.stdout)
    assert done.returncode == 0, done.stdout + done.stderr
    assert not done.stderr
    return done.stdout


@pytest.mark.external
@pytest.mark.parametrize(
    ("form", "checked"), [*((form, ()) for form in FORMS), ("default", ("-DFSM_CHECKED",))]
)
def test_every_event_is_accounted_for(
    form: str, checked: tuple[str, ...], tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    arguments = (*SANITIZERS, *checked, str(HERE / "misuse.c"))
    clang = require_tool("clang")
    told = run_program(tmp_path, FORMS[form], clang, arguments, str(EVENTS), SEED)
    assert len(told.splitlines()) == 11


@pytest.mark.parametrize("form", FORMS if IS_LONG else ["default"])
def test_other_threads_lose_nothing_uncounted(
    form: str, tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    arguments = ("-fsanitize=thread", f"-I{HOSTS}", "-pthread", str(HERE / "mailboxes.c"))
    run_program(tmp_path, FORMS[form], require_tool("clang"), arguments, str(EVENTS // 2))
