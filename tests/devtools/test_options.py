"""A wrong option of a tool for developers is told in one line, not by a traceback."""

from __future__ import annotations

import click
import pytest
from click.testing import CliRunner

from devtools.copies import main as compare_copies
from devtools.coverage import main as compare_coverage
from devtools.differential import main as compare_runtimes
from devtools.endurance.__main__ import main as endure
from devtools.formatting import main as try_formatter


@pytest.mark.parametrize(
    ("command", "arguments", "message"),
    [
        (compare_runtimes, ["--targets", "c,nope"], "nothing runs a chart as `nope`: use interp"),
        (compare_copies, ["--runtimes", "nope"], "nothing runs a chart as `nope`: use interp"),
        (compare_coverage, ["--optimize", "nope"], "'nope' is not 'size'"),
        (endure, ["nope.yaml"], "'nope.yaml' does not exist"),
        (try_formatter, ["many"], "'many' is not a valid"),
    ],
)
def test_a_wrong_value_is_named(command: click.Command, arguments: list[str], message: str) -> None:
    done = CliRunner().invoke(command, arguments)
    assert done.exit_code == 2
    assert message in done.output
