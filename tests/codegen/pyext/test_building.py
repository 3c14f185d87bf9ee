"""Building an extension module: its files, its types, the compiler, difficult names."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import sysconfig
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from devtools.differential import random_case
from fsmkit.chart.loading import load
from fsmkit.cli import execute
from fsmkit.codegen.c.limits import report_limits
from fsmkit.codegen.pyext.build import suffix
from fsmkit.codegen.pyext.generate import generate
from fsmkit.codegen.pyext.members import module_of
from fsmkit.codegen.python.loading import load_machine
from fsmkit.diagnostics import Findings
from fsmkit.testing.harness.pyext import load_class
from tests.codegen.pyext.press import PRESS
from tests.needs import where

USER = """\
from press import Colour, Press, PressHost

class Mine(Press):
    __slots__ = ()
    def goto(self, position: int, speed: int) -> None: ...
    def at_limit(self) -> bool:
        return True
    def measure(self, offset: int) -> int:
        return self.weight + offset
    def title(self, of: int) -> str:
        return Colour(of).name
    def mark(self, spot: object, last: object) -> None: ...
    def send_pushed(self, count: int) -> None: ...
    def send_moved(self, spot: object, label: str) -> None: ...

machine = Mine()
host: PressHost = machine
machine.start(0)
assert machine.dispatch_paint(Colour.blue, label="x") and machine.label == "blue"
print(machine.active(), machine.next_deadline(), machine.is_in("idle"))
"""
WITHIN = """\
import {interpreters} as interpreters
code = '''
import press
class Host:
    def __getattr__(self, name):
        return lambda *given: 5
machine = press.Press(Host())
machine.start(0)
assert machine.dispatch_boom() and machine.weight == 5
machine.label = "only here"
'''
for _ in range(3):
    made = interpreters.create()
    interpreters.run_string(made, code)
    interpreters.destroy(made)
exec(code)
print("fine")
"""


@pytest.fixture
def press(tmp_path: Path) -> Path:
    path = tmp_path / "press.yaml"
    path.write_text(PRESS)
    return path


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory, require_tool: Callable[[str], str]) -> Path:
    require_tool("cc")
    folder = tmp_path_factory.mktemp("built")
    (folder / "press.yaml").write_text(PRESS)
    arguments = ["compile", str(folder / "press.yaml"), "--target", "pyext", "--out", str(folder)]
    assert execute(arguments) == 0
    return folder


def python(folder: Path, *arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, *arguments], cwd=folder, capture_output=True, text=True, check=False,
        env={"PYTHONPATH": str(folder), "MYPYPATH": str(folder), "PATH": "/usr/bin:/bin"},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.cc
def test_a_module_is_built_and_its_types_are_right(built: Path) -> None:
    assert (built / f"press{suffix()}").is_file()
    (built / "user.py").write_text(USER)
    assert python(built, "user.py") == "('idle',) None True\n"
    assert "Success" in python(built, "-m", "mypy", "--strict", "user.py")
    stub = python(built, "-m", "mypy.stubtest", "--ignore-disjoint-bases", "press")
    assert "Success" in stub


@pytest.mark.cc
@where(
    any(map(importlib.util.find_spec, ("_interpreters", "_xxsubinterpreters"))),
    "this Python has no interpreters within",
)
def test_each_interpreter_has_its_own(built: Path) -> None:
    for name in ("_interpreters", "_xxsubinterpreters"):
        if importlib.util.find_spec(name):
            (built / "within.py").write_text(WITHIN.format(interpreters=name))
            assert python(built, "within.py") == "fine\n"
            return


@pytest.mark.cc
@pytest.mark.parametrize("is_traced", [False, True])
def test_what_is_generated_is_clean(
    press: Path, require_tool: Callable[[str], str], *, is_traced: bool
) -> None:
    require_tool("gcc")
    _, files = generate(load(press), traced=is_traced)
    for name, text in files.items():
        (press.parent / name).write_text(text)
    include = f"-I{sysconfig.get_path('include')}"
    flags = ["-fsyntax-only", "-O1", "-Wall", "-Wextra", "-Wshadow", "-Werror", include]
    done = subprocess.run(
        ["gcc", *flags, "press_python.c"], cwd=press.parent, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


def test_sources_alone(press: Path) -> None:
    folder = press.parent / "made"
    given = ["compile", str(press), "--target", "pyext", "--out", str(folder)]
    assert execute([*given, "--no-build", "--prefix", "Sided"]) == 0
    names = {path.name for path in folder.iterdir()}
    assert names == {
        "sided.pyi", "sided_python.c", "sided_machine.c", "sided_machine.h", "sided_machine_info.c",
        "fsm.c", "fsm.h", "fsm_info.h", "fsm_python.h", "fsm_python_hooks.h",
    }  # fmt: skip
    assert "class Sided:" in (folder / "sided.pyi").read_text()
    assert execute(["compile", str(press), "--no-build"]) == 2


def test_what_is_missing_is_told(
    press: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = press.parent / "made"
    given = ["compile", str(press), "--target", "pyext", "--out", str(folder)]
    monkeypatch.setenv("CC", "no-such-compiler")
    assert execute(given) == 1
    assert "FK0401" in capsys.readouterr().err
    monkeypatch.delenv("CC")
    monkeypatch.setattr(sysconfig, "get_path", lambda _: str(press.parent))
    assert execute(given) == 1
    assert "FK0407" in capsys.readouterr().err
    assert not folder.exists()


HURTING = """\
chart: time
data: {errno: uint8 = 0, stdin: bool = false, EOF: int8 = 0, st_mtime: uint8 = 0,
       self: uint8 = 0, o: uint8 = 0, PyObject: uint8 = 0, log: uint8 = 0}
types: {"Kind": [none, IntEnum, int]}
operations: ["exit(errno uint8, value uint8)", "printf(o uint8) -> uint8"]
events:
  in: ["malloc(errno uint8, self uint8, out uint8)", EOF(EOF int8), Py_BuildValue, "class", "a.b"]
  out: ["longjmp(value uint8, o uint8)"]
initial: I
states:
  I:
    on:
      malloc:
        do: >-
          errno = event.errno; exit(errno, event.out); self = printf(event.self);
          send longjmp(value = errno, o = self)
      EOF: {do: EOF = event.EOF}
      class: Py_TYPE
  Py_TYPE: {}
"""


@pytest.mark.cc
def test_names_that_the_headers_have(tmp_path: Path) -> None:
    path = tmp_path / "time.yaml"
    path.write_text(HURTING)
    chart = load(path)

    class Host:
        told: list[tuple[int, ...]]

        def exit(self, *given: int) -> None:
            self.told.append(given)

        def printf(self, o: int) -> int:
            return o + 1

        def send_longjmp(self, *given: int) -> None:
            self.told.append(given)

    for made in (load_class(chart), load_machine(chart)):
        host = Host()
        host.told = []
        machine: Any = made(host)
        machine.start(0)
        assert machine.dispatch_malloc(7, self_=8, out=9)
        assert machine.dispatch_EOF(-3)
        assert (machine.errno, machine.EOF, machine.self) == (7, -3, 9)
        assert host.told == [(7, 9), (7, 9)]
        machine.stdin = machine.st_mtime = machine.log_ = 1
        assert machine.dispatch_class_()
        assert machine.active() == ("Py_TYPE",)


@pytest.mark.slow
def test_hosts_provide_what_they_provide_for_python() -> None:
    compared = 0
    for number in range(60):
        chart = random_case(11, number).chart
        findings = Findings()
        report_limits(chart, findings)
        if not findings.has_errors:
            calls = module_of(chart).bound.calls
            assert tuple(call.name for call in calls) == load_machine(chart).OPERATIONS
            compared += len(calls)
    assert compared > 60
