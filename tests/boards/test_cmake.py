"""Charts in projects of CMake and of pkg-config: one line adds a chart."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import fsmkit
from fsmkit.cli.tools.paths import PATHS
from tests.boards.conftest import RUNTIME, Build, Run

RequireTool = Callable[[str], str]

BASE = """\
chart: Blink
abstract: true
operations: [light(on bool)]
events: {in: [press]}
constants: {LEVEL: 1}
outputs: {level: uint8 = 0}
initial: dark
states:
  dark: {entry: level = 0, on: {press: lit}}
  lit: {entry: level = LEVEL, after: {3ms: dark}}
"""
DERIVED = "chart: {name}\nextends: base.yaml\n"
MAIN = """\
#include "gate.h"
#include "fsm_mailbox.h"
#include "posix/fsm_posix.h"
#include "second.h"

FSM_MAILBOX(gate, GATE_QUEUE, 4)
static gate one;
static second two;
static gate_mailbox box;
static fsm_posix host;

void gate_light(gate *m, bool on) { (void)m; (void)on; }
void second_light(second *m, bool on) { (void)m; (void)on; }

static void step(void *unused, uint32_t now)
{
    (void)unused;
    gate_mailbox_run(&box, &one, now);
    second_run(&two, now);
    if (now >= 5u)
        fsm_posix_stop(&host);
}

int main(void)
{
    gate_event press = GATE_NO_EVENT;
    press.event = GATE_EVENT_PRESS;
    if (fsm_posix_init(&host, GATE_TICK_US) != 0)
        return 2;
    gate_init(&one);
    second_init(&two);
    gate_start(&one, 0);
    second_start(&two, 0);
    gate_mailbox_put(&box, &press);
    second_post_press(&two);
    gate_mailbox_run(&box, &one, 0);
    second_run(&two, 0);
    printf("level %d", one.out.level);
    fsm_posix_periodic(&host, step, NULL);
    printf(" then %d\\n", one.out.level);
    fsm_posix_close(&host);
    return 0;
}
"""
PROJECT = """\
cmake_minimum_required(VERSION 3.16)
project(sample C)
find_package(fsmkit {version} REQUIRED)
add_executable(sample main.c)
target_link_libraries(sample PRIVATE fsmkit::posix)
{lines}
"""
GATE = "fsmkit_add_machine(sample gate.yaml)"
LINES = f"{GATE}\nfsmkit_add_machine(sample second.yaml)"


@pytest.fixture
def project(tmp_path: Path, require_tool: RequireTool) -> Path:
    """A project of two machines, in a folder with a space in its name."""
    require_tool("cmake")
    require_tool("cc")
    folder = tmp_path / "my project"
    folder.mkdir()
    (folder / "base.yaml").write_text(BASE, encoding="utf-8")
    for name in ("Gate", "Second"):
        (folder / f"{name.lower()}.yaml").write_text(DERIVED.format(name=name), encoding="utf-8")
    (folder / "main.c").write_text(MAIN, encoding="utf-8")
    write_project(folder)
    return folder


def write_project(folder: Path, lines: str = LINES, version: str = "") -> None:
    text = PROJECT.format(lines=lines, version=version)
    (folder / "CMakeLists.txt").write_text(text, encoding="utf-8")


def cmake(
    folder: Path, *arguments: str, environment: dict[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["cmake", *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        env=environment,
    )


def configure(folder: Path) -> subprocess.CompletedProcess[str]:
    executable = Path(sys.executable).parent / "fsmkit"
    return cmake(
        folder,
        *("-S", ".", "-B", "build", f"-Dfsmkit_DIR={PATHS['cmake']}"),
        *(f"-DFSMKIT_EXECUTABLE={executable}", "-DCMAKE_C_FLAGS=-Wall -Wextra -Wpedantic -Werror"),
    )


def make(folder: Path) -> str:
    done = cmake(folder, "--build", "build")
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.external
def test_a_line_adds_a_chart(project: Path, run: Run) -> None:
    done = configure(project)
    assert done.returncode == 0, done.stderr
    make(project)
    assert run(project / "build/sample") == "level 1 then 0\n"
    assert "Building" not in make(project)
    (project / "base.yaml").write_text(BASE.replace("LEVEL: 1", "LEVEL: 7"), encoding="utf-8")
    rebuilt = make(project)
    assert run(project / "build/sample") == "level 7 then 0\n"
    built = set(re.findall(r"Building C object \S*?(\w+)\.c\.o", rebuilt))
    assert {"gate", "second"} <= built
    assert not built & {"fsm", "fsm_posix"}, "what did not change is not compiled again"


@pytest.mark.slow
@pytest.mark.external
@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ("fsmkit_add_machine(sample wrong.yaml)", "FK0"),
        ("fsmkit_add_machine(sample missing.yaml)", "missing.yaml"),
        (f"{GATE}\nfsmkit_add_machine(sample twin.yaml)", "another machine .*PREFIX"),
        ("fsmkit_add_machine(other gate.yaml)", "no target `other`"),
        ("fsmkit_add_machine(sample gate.yaml FAST)", "what is `FAST`"),
    ],
)
def test_what_is_wrong_is_said_when_configuring(project: Path, lines: str, said: str) -> None:
    (project / "wrong.yaml").write_text("chart: Wrong\nstates: {a: {on: {e: b}}}\n", "utf-8")
    twin = BASE.replace("abstract: true\n", "").replace("Blink", "Gate")
    (project / "twin.yaml").write_text(twin, encoding="utf-8")
    write_project(project, lines)
    done = configure(project)
    assert done.returncode != 0
    assert re.search(said, " ".join(done.stderr.split())), done.stderr


@pytest.mark.slow
@pytest.mark.external
def test_prefix_and_library(project: Path) -> None:
    """A library offers the headers of its machines to those that link it."""
    lines = (
        "add_library(machines STATIC empty.c)\n"
        "fsmkit_add_machine(machines gate.yaml PREFIX third DEPENDS main.c)\n"
        "add_executable(user user.c)\ntarget_link_libraries(user machines)"
    )
    (project / "empty.c").write_text("typedef int empty;\n", encoding="utf-8")
    (project / "user.c").write_text(
        '#include "third.h"\nstatic third m;\n'
        "void third_light(third *of, bool on) { (void)of; (void)on; }\n"
        "int main(void) { third_init(&m); return m.out.level; }\n",
        encoding="utf-8",
    )
    write_project(project, f"{LINES}\n{lines}")
    assert configure(project).returncode == 0
    make(project)


@pytest.mark.external
def test_versions(project: Path) -> None:
    write_project(project, lines="", version=fsmkit.__version__)
    assert configure(project).returncode == 0
    write_project(project, lines="", version="99")
    done = configure(project)
    assert done.returncode != 0
    assert "99" in done.stderr


@pytest.mark.external
def test_without_fsmkit(project: Path, tmp_path: Path) -> None:
    copied = tmp_path / "elsewhere/a/b/c"
    shutil.copytree(RUNTIME, copied)
    found = {Path(tool).parent for name in ("cmake", "cc", "make") if (tool := shutil.which(name))}
    path = os.pathsep.join(map(str, found - {Path(sys.executable).parent}))
    done = cmake(
        project,
        *("-S", ".", "-B", "build", f"-Dfsmkit_DIR={copied / 'cmake'}"),
        environment={**os.environ, "PATH": path},
    )
    assert done.returncode != 0
    assert "FSMKIT_EXECUTABLE" in done.stderr


@pytest.mark.external
def test_pkg_config(project: Path, require_tool: RequireTool, build: Build, run: Run) -> None:
    tool = require_tool("pkg-config")
    environment = {**os.environ, "PKG_CONFIG_PATH": str(PATHS["pkgconfig"])}

    def pkg_config(*arguments: str) -> list[str]:
        words = [tool, *arguments, "fsmkit"]
        return subprocess.check_output(words, env=environment, text=True).split()

    assert pkg_config("--modversion") == [fsmkit.__version__]
    fsmkit_command = Path(sys.executable).parent / "fsmkit"
    for name in ("gate", "second"):
        run(fsmkit_command, "compile", project / f"{name}.yaml", "--out", project)
    files = sorted(path.name for path in project.glob("*.c"))
    arguments = (*pkg_config("--cflags"), *files, *pkg_config("--variable=posix"), "-pthread")
    assert run(build(project, "gcc", *arguments)) == "level 1 then 0\n"
    for variable in ("posix", "cortex_m"):
        assert [Path(path).is_file() for path in pkg_config(f"--variable={variable}")] == [True]
