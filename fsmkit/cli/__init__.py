"""The command line: one file per verb, found by looking.

A module of this package that defines ``command`` (a `click.Command`) is a verb.
"""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path

import click

import fsmkit
from fsmkit.cli.console import crash, interrupted, report
from fsmkit.diagnostics import FsmkitError

OK, FINDINGS, USAGE, BUG, INTERRUPTED = 0, 1, 2, 3, 130
NO_VERBS = {"console", "writing"}
"""Modules of this package that serve the verbs."""


class Verbs(click.Group):
    """The group of verbs; a verb's module is imported when the verb is used or listed."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all verbs."""
        del ctx
        stems = {file.stem for file in Path(__file__).parent.glob("*.py")}
        return sorted(stem for stem in stems - NO_VERBS if not stem.startswith("_"))

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the verb of that name."""
        if cmd_name not in self.list_commands(ctx):
            return None
        command = import_module(f"{__name__}.{cmd_name}").command
        assert isinstance(command, click.Command)  # noqa: S101  (a law of this package)
        return command


@click.group(cls=Verbs, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(fsmkit.__version__, package_name="fsmkit")
def cli() -> None:
    r"""Statecharts for control engineers: compile, check, run, draw.

    Exit codes: 0 fine, 1 findings or a violated property, 2 usage, 3 a bug of ours.

    \b
    Example:
      fsmkit check machine.yaml
      fsmkit compile machine.scxml --out generated
    """


def main() -> None:
    """Run the command line and exit; no traceback reaches a user."""
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run one command line and return its exit code."""
    try:
        return cli.main(arguments, prog_name="fsmkit", standalone_mode=False) or OK
    except FsmkitError as error:
        report(error.diagnostics)
        return FINDINGS
    except click.ClickException as error:
        error.show()
        return USAGE
    except (KeyboardInterrupt, click.Abort):
        return interrupted()
    except click.exceptions.Exit as error:
        return error.exit_code
    except BrokenPipeError:
        sys.stderr.close()
        return OK
    except Exception as error:  # noqa: BLE001  (the last line of defence: a bug becomes a report)
        return crash(error)
