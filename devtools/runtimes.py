"""Runtimes as an option of a command line: names with commas, each of which has a harness."""

from __future__ import annotations

import click

from fsmkit.diagnostics import FsmkitError
from fsmkit.runtime.harness import harness


def runtimes(_: click.Context, __: click.Parameter, value: str | None) -> tuple[str, ...]:
    """Return the names in the value of an option; none where it is not given.

    Raises:
        click.BadParameter: a name has no harness; the message lists those that have.

    """
    try:
        return tuple(harness(name.strip()).name for name in value.split(",")) if value else ()
    except FsmkitError as error:
        (found,) = error.diagnostics
        raise click.BadParameter(f"{found.message}: {found.help}") from None
