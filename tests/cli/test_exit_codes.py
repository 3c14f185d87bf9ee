"""Exit codes of every verb: 0 fine, 1 findings, 2 usage, 3 a bug of ours, 130 interrupted."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from shlex import quote
from shutil import copy

import click
import pytest

from fsmkit.cli import Verbs, cli, execute
from fsmkit.cli.common.options import OneOf

pytestmark = pytest.mark.usefixtures("own_cache", "quickly_compiled")
FILES = Path(__file__).parent / "mistakes"
GROUP = cli
assert isinstance(GROUP, Verbs)
CONTEXT = click.Context(GROUP)
VERBS = GROUP.list_commands(CONTEXT)
FINE: dict[str, list[str]] = {
    "cache": ["--json"],
    "compile": ["gate.yaml", "--target", "python", "--out", "out"],
    "convert": ["gate.yaml", "--to", "scxml"],
    "diff": ["gate.yaml", "gate.yaml"],
    "draw": ["gate.yaml", "--out", "gate.mmd"],
    "explain": ["unread-data"],
    "export": ["gate.yaml", "--to", "jani", "--out", "gate.jani"],
    "merge": ["gate.yaml", "gate.yaml", "gate.yaml"],
    "fmt": ["--check", "gate.yaml"],
    "new": ["fresh.yaml"],
    "paths": [],
    "run": ["gate.yaml", "--events", "go"],
    "schema": ["chart"],
    "show": ["gate.yaml"],
    "targets": [],
    "test": ["gate.test.yaml"],
}
"""Arguments with which nothing is wrong; of the other verbs only ``--help`` is, without tools."""
BROKEN: dict[str, list[str]] = {
    "bind": ["none.h", "--chart", "gate.yaml"],
    "certify": ["broken.yaml"],
    "check": ["broken.yaml"],
    "check-certificate": ["none.cert", "broken.yaml"],
    "compile": ["broken.yaml"],
    "convert": ["broken.yaml", "--to", "scxml"],
    "coverage": ["none"],
    "deploy": ["none.yaml", "--to", "systemd", "--exec", "/x"],
    "cover": ["broken.yaml", "--out", "made"],
    "diff": ["gate.yaml", "broken.yaml"],
    "draw": ["broken.yaml"],
    "evidence": ["broken.yaml", "--out", "made"],
    "export": ["broken.yaml", "--to", "jani"],
    "fmt": ["none.yaml"],
    "health": ["none.yaml"],
    "io": ["none.io.yaml", "--map", "none", "show"],
    "latency": ["none.json"],
    "merge": ["none.yaml", "gate.yaml", "gate.yaml"],
    "mutants": ["broken.yaml"],
    "refine": ["broken.yaml", "gate.yaml"],
    "new": ["gate.yaml"],
    "run": ["broken.yaml", "--events", "go"],
    "serve": ["broken.yaml"],
    "show": ["broken.yaml"],
    "simulate": ["broken.yaml", "--out", "x.fmu"],
    "test": ["broken.test.yaml"],
    "trace": ["none.trace"],
    "trace-requirements": ["gate.yaml", "-r", "broken.yaml", "--engine", "python"],
}
"""Arguments of right usage with input that is wrong."""
READS: dict[str, tuple[str, list[str]]] = {
    "bind": (".h", ["--chart", "gate.yaml"]),
    "campaign": (".yaml", []),
    "certify": (".yaml", ["--out", "made.json"]),
    "check": (".yaml", []),
    "check-certificate": ("", ["gate.yaml"]),
    "compile": (".yaml", ["--out", "made"]),
    "conformance": ("", []),
    "convert": (".yaml", ["--to", "scxml"]),
    "cover": (".yaml", ["--out", "made"]),
    "coverage": (".json", []),
    "deploy": (".yaml", ["--to", "systemd", "--exec", "/x", "--out", "made"]),
    "diff": (".yaml", ["gate.yaml"]),
    "draw": (".scxml", ["--out", "made.mmd"]),
    "evidence": (".yaml", ["--out", "made"]),
    "export": (".yaml", ["--to", "jani", "--out", "made.jani"]),
    "fmt": (".yaml", []),
    "health": (".yaml", []),
    "io": (".io.yaml", ["show", "--map", "window"]),
    "latency": (".json", []),
    "merge": (".yaml", ["gate.yaml", "guard.yaml"]),
    "mutants": (".yaml", []),
    "refine": (".yaml", ["gate.yaml"]),
    "run": (".scxml", ["--events", "go"]),
    "serve": (".yaml", []),
    "show": (".yaml", []),
    "simulate": (".yaml", ["--out", "made.html"]),
    "test": (".test.yaml", []),
    "trace": (".trace", ["--charts", "gate.yaml"]),
    "trace-requirements": (".yaml", ["-r", "r.csv"]),
}
"""Of each verb that reads what it is given: a suffix, and arguments with which usage is right."""
READS_NONE = {"cache", "dap", "edit", "explain", "lsp", "mcp", "new", "paths", "schema", "targets"}


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Stand in a folder with files that are right, and some that are not."""
    for path in FILES.glob("g*.*ml"):
        copy(path, tmp_path)
    (tmp_path / "broken.yaml").write_text("chart: B\nstates:\n\ta: {}\n")
    (tmp_path / "broken.test.yaml").write_text("tests: B\nchart: gate.yaml\ncases: {a: [post x]}\n")
    (tmp_path / "r.csv").write_text("id,text\nA,a\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def command_of(verb: str) -> click.Command:
    assert isinstance(GROUP, Verbs)
    found = GROUP.get_command(CONTEXT, verb)
    assert found is not None
    return found


def marked(verb: str) -> object:
    """Return a verb, marked where it starts a program: a compiler, or git."""
    return pytest.param(verb, marks=pytest.mark.cc) if verb in ("bind", "export", "merge") else verb


CHOICES = [
    (verb, option.opts[-1])
    for verb in VERBS
    for option in command_of(verb).params
    if isinstance(option, click.Option) and isinstance(option.type, OneOf | click.Choice)
]


@pytest.mark.parametrize("verb", VERBS)
def test_help_is_fine(verb: str) -> None:
    assert execute([verb, "--help"]) == 0


@pytest.mark.parametrize("verb", [marked(verb) for verb in FINE])
def test_what_is_right_is_fine(verb: str) -> None:
    assert execute([verb, *FINE[verb]]) == 0


@pytest.mark.parametrize("verb", [marked(verb) for verb in BROKEN])
def test_wrong_input_is_a_finding(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute([verb, *BROKEN[verb]]) == 1
    told = capsys.readouterr()
    assert "error[" in told.err
    assert "Traceback" not in told.err


def test_each_verb_that_reads_files_is_here() -> None:
    assert {*READS} | READS_NONE == {*VERBS}


@pytest.mark.parametrize("kind", ["empty", "missing", "folder", "binary", "other"])
@pytest.mark.parametrize("verb", [marked(verb) for verb in READS])
def test_a_file_that_is_of_no_use_is_a_finding(
    verb: str, kind: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    suffix, more = READS[verb]
    named = folder / f"given{'.txt' if kind == 'other' else suffix}"
    if kind == "folder":
        named.mkdir()
    elif kind != "missing":
        named.write_bytes({"empty": b"", "binary": bytes(range(256)), "other": b"x: 1\n"}[kind])
    before = {path.name for path in folder.iterdir()}
    assert execute([verb, named.name, *more]) == 1
    told = capsys.readouterr()
    assert "error[" in told.err
    assert "Traceback" not in told.out + told.err
    assert {path.name for path in folder.iterdir()} == before


@pytest.mark.parametrize("verb", VERBS)
def test_an_unknown_option_is_usage(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute([verb, "--no-such-option"]) == 2
    assert "No such option" in capsys.readouterr().err


@pytest.mark.parametrize(("verb", "option"), CHOICES)
def test_an_unknown_value_is_usage_and_lists_the_values(
    verb: str, option: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (found,) = (o for o in command_of(verb).params if option in o.opts)
    assert execute([verb, option, "zz_none"]) == 2
    told = " ".join(capsys.readouterr().err.split())
    known = found.type.choices if isinstance(found.type, OneOf | click.Choice) else ()
    assert "zz_none" in told
    assert all(str(value) in told for value in known)


def interrupted_import() -> RuntimeError:
    """Return what Python 3.11 raises where an interrupt meets the creation of a class."""
    error = RuntimeError("Error calling __set_name__ on 'Field' instance 'span' in 'Local'")
    error.__cause__ = KeyboardInterrupt()
    return error


@pytest.mark.parametrize(
    ("raised", "code"),
    [
        (ValueError("x"), 3),
        (KeyboardInterrupt(), 130),
        (AssertionError(), 3),
        (interrupted_import(), 130),
    ],
)
@pytest.mark.parametrize("verb", VERBS)
def test_a_bug_and_an_interrupt(
    verb: str, raised: BaseException, code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object, **__: object) -> int:
        raise raised

    command = command_of(verb)
    monkeypatch.setattr(command, "parse_args", lambda *_: [])
    monkeypatch.setattr(command, "callback", fails)
    assert execute([verb]) == code


@pytest.mark.parametrize("name", ["a" * 5_000, "a/" * 2_048 + "a"])
@pytest.mark.parametrize(
    "verb", [pytest.param(v, marks=[pytest.mark.cc] if v == "bind" else []) for v in READS]
)
def test_a_name_that_no_file_can_have_is_a_finding(
    verb: str, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    suffix, arguments = READS[verb]
    assert execute([verb, name + suffix, *arguments]) in (1, 2)
    printed = capsys.readouterr().err
    assert "bug" not in printed
    assert "error" in printed.lower()


@pytest.mark.cc
@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", ">&- 2>&-", "<&- >&- 2>&-"])
def test_closed_streams_change_no_exit_code(closed: str, tmp_path: Path) -> None:
    copy(FILES / "gate.yaml", tmp_path)
    for code, arguments in ((0, "show gate.yaml"), (1, "show none.yaml"), (2, "show --none")):
        command = f"exec {quote(sys.executable)} -m fsmkit {arguments} {closed}"
        ended = subprocess.run(
            ["sh", "-c", command], cwd=tmp_path, capture_output=True, check=False
        )
        assert ended.returncode == code, (arguments, ended.stderr)
        assert not any(word in ended.stderr for word in (b"Traceback", b"bug"))
