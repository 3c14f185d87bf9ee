"""Runtimes as an option of a command line: names with commas, each of which has a harness."""

from __future__ import annotations

import click

from devtools.processors import CROSS
from fsmkit.codegen import harness
from fsmkit.codegen.harness import Harness
from fsmkit.diagnostics import FsmkitError


def runtime(name: str) -> Harness:
    """Return the harness of a target, or of generated C on another processor.

    Raises:
        FsmkitError: there is none of that name.

    """
    return CROSS.get(name) or harness.harness(name)


def runtimes(_: click.Context, __: click.Parameter, value: str | None) -> tuple[str, ...]:
    """Return the names in the value of an option; none where it is not given.

    Raises:
        click.BadParameter: a name has no harness; the message lists those that have.

    """
    try:
        return tuple(runtime(name.strip()).name for name in value.split(",")) if value else ()
    except FsmkitError as error:
        (found,) = error.diagnostics
        known = f"{found.help}, {', '.join(CROSS)}"
        raise click.BadParameter(f"{found.message}: {known}") from None
