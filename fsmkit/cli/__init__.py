"""The command line: one file per verb, in a folder for each group of verbs, found by looking.

A module of such a folder that defines ``command`` (a `fsmkit.cli.common.verbs.Verb`) is a verb.
"""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Callable
from pathlib import Path

import click
from click.shell_completion import CompletionItem

import fsmkit
from fsmkit.cli.common.console import (
    WrongOptionError,
    crash,
    interrupted,
    print_json,
    report,
    reported,
    set_up,
)
from fsmkit.cli.common.exhausted import exhausted
from fsmkit.cli.common.garbage import COLLECT_AFTER
from fsmkit.cli.common.interrupts import leave_at_once, listen, received
from fsmkit.cli.common.options import no_such
from fsmkit.cli.common.summaries import GROUPS, command_of, listed, verbs
from fsmkit.cli.common.verbs import Options
from fsmkit.cli.common.writing import write_files
from fsmkit.diagnostics import FsmkitError, Severity
from fsmkit.diagnostics.as_json import as_json
from fsmkit.emit.lines import json_text

OK, FINDINGS, USAGE, BUG, INTERRUPTED = 0, 1, 2, 3, 130
OF_OPTIONS = {
    "unknown-plugin",
    "unknown-part",
    "unknown-aim",
    "no-such-property",
    "no-such-machine",
    "not-a-system",
    "wrong-option",
}
"""Rules that nothing but the value of an option breaks: the command line is used wrongly."""


LONGEST = 12
"""Characters of a verb that is on one line with its description."""


class Verbs(click.Group):
    """The group of verbs; a verb's module is imported when the verb is used, not when listed."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all verbs."""
        del ctx
        return sorted(verbs())

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the verb of that name."""
        del ctx
        return command_of(cmd_name) if cmd_name in verbs() else None

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write a line for each verb, in groups; two for one with a long name."""
        del ctx
        width = max(length for length in map(len, verbs()) if length <= LONGEST)
        limit = formatter.width - 6 - width
        for title, folder in GROUPS.items():
            members = [name for name, place in verbs().items() if place == folder]
            with formatter.section(title):
                rows = [(n.ljust(width), listed(n).get_short_help_str(limit)) for n in members]
                formatter.write_dl(rows, width)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Return the verbs and options with the given prefix."""
        names = [name for name in self.list_commands(ctx) if name.startswith(incomplete)]
        verbs = [CompletionItem(name, help=listed(name).get_short_help_str()) for name in names]
        return [*verbs, *click.Command.shell_complete(self, ctx, incomplete)]

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the verb and the rest of the line; the error for a wrong one names the nearest."""
        if args and not args[0].startswith("-") and args[0] not in self.list_commands(ctx):
            raise click.UsageError(no_such("verb", args[0], self.list_commands(ctx)), ctx)
        return super().resolve_command(ctx, args)


SETTINGS = {"help_option_names": ["-h", "--help"], "max_content_width": 100}


@click.group(cls=Verbs, context_settings=SETTINGS)
@click.version_option(fsmkit.__version__, package_name="fsmkit", help="Print the version.")
def cli() -> None:
    """Statecharts for control engineers: write, run, prove, compile, test and deploy them.

    `fsmkit VERB --help` explains a verb. Exit codes: 0 success; 1 findings, or a violated or
    undecided property; 2 wrong usage; 3 an internal error.
    """


def main() -> None:
    """Run the command line and exit; no traceback reaches a user."""
    gc.set_threshold(COLLECT_AFTER, 50, 50)
    listen()
    try:
        code = execute(sys.argv[1:])
        code = _guarded(_flush) or code
    except KeyboardInterrupt:  # while findings were printed
        code = interrupted()
    leave_at_once()
    gc.freeze()  # otherwise Python traverses all objects of a chart again at exit
    sys.exit(received() or code)


def _flush() -> int:
    """Write the buffered output; discard what cannot be written."""
    try:
        sys.stdout.flush()
    except BaseException:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise
    return OK


def execute(arguments: list[str]) -> int:
    """Run one command line and return its exit code."""
    options = Options()
    reported.clear()
    set_up()
    code = _guarded(
        lambda: cli.main(arguments, prog_name="fsmkit", standalone_mode=False, obj=options) or OK,
        is_json="--json" in arguments,
    )
    if options.sarif is not None:
        path = options.sarif
        code = _guarded(lambda: _write_sarif(path)) or code
    return code


def _write_sarif(path: Path) -> int:
    from fsmkit.diagnostics.sarif import sarif_log

    log = sarif_log(reported, fsmkit.__version__)
    write_files({path: json_text(log)})
    return OK


def _guarded(body: Callable[[], int], *, is_json: bool = False) -> int:
    """Run a body, report exceptions, and return the exit code. ``is_json``: print JSON, too."""
    try:
        return body()
    except WrongOptionError as error:
        report(error.diagnostics)
        return USAGE
    except FsmkitError as error:
        report(error.diagnostics)
        if is_json:
            found = [as_json(diagnostic) for diagnostic in error.diagnostics]
            print_json({"verdict": "error", "findings": found})
        broken = {d.rule.name for d in error.diagnostics if d.severity is Severity.ERROR}
        return USAGE if broken <= OF_OPTIONS else FINDINGS
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
    except (MemoryError, OSError, ImportError, RuntimeError) as error:
        if isinstance(error.__cause__, KeyboardInterrupt):  # Python 3.11 wraps it in class bodies
            return interrupted()
        told = exhausted(error)
        if told is None:
            return crash(error)
        report(told.diagnostics)
        return FINDINGS
    except Exception as error:  # noqa: BLE001  (the last line of defence: a bug becomes a report)
        return crash(error)
