"""What a short command line imports: lists and names need neither the model nor its parsers."""

from __future__ import annotations

import subprocess
import sys

import click
import pytest
from click.shell_completion import ShellComplete

from fsmkit.cli import cli
from fsmkit.cli.common.summaries import listed

HEAVY = {"lark", "lxml", "yaml", "rich", "fsmkit.chart", "fsmkit.verify", "fsmkit.codegen"}
PROGRAM = """\
import sys
from fsmkit.cli import execute
code = execute(sys.argv[1:])
print(code, *sys.modules, file=sys.stderr)
"""


def imported(*arguments: str) -> tuple[str, set[str]]:
    """Run a command line in a process of its own; return its exit code and what it imported."""
    command = [sys.executable, "-c", PROGRAM, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    code, *modules = done.stderr.splitlines()[-1].split()
    return code, set(modules)


@pytest.mark.cc
@pytest.mark.parametrize("line", [["--help"], ["--version"], ["complie"], ["--colour"]])
def test_a_list_or_a_wrong_verb_imports_no_model(line: list[str]) -> None:
    code, modules = imported(*line)
    assert code == ("0" if line[0] in ("--help", "--version") else "2")
    assert "fsmkit.cli" in modules
    assert not modules & HEAVY


@pytest.mark.cc
def test_plug_ins_are_found_without_the_work_that_they_do() -> None:
    program = """
import sys
from fsmkit.codegen.target import Target
from fsmkit.plugins import plugin
plugin(Target, "c")
print(*sys.modules)
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    modules = set(done.stdout.split())
    assert "fsmkit.codegen.python.plugin" in modules
    assert not modules & {
        "lxml", "yaml", "rich", "zmq", "fsmkit.codegen.c.generate",
        "fsmkit.codegen.python.generate",
        "fsmkit.chart.elaborate", "fsmkit.scxml.reader", "fsmkit.yaml.reader",
    }  # fmt: skip


def test_completion_offers_verbs_and_options() -> None:
    complete = ShellComplete(cli, {}, "fsmkit", "_FSMKIT_COMPLETE")
    assert [item.value for item in complete.get_completions([], "co")] == [
        "compile", "conformance", "convert", "cover", "coverage",
    ]  # fmt: skip
    assert [item.value for item in complete.get_completions([], "--ve")] == ["--version"]


@pytest.mark.parametrize("verb", cli.list_commands(click.Context(cli)))
def test_a_verb_is_listed_as_it_describes_itself(verb: str) -> None:
    command = cli.get_command(click.Context(cli), verb)
    assert command is not None
    assert listed(verb).get_short_help_str() == command.get_short_help_str() != ""
