"""All runtimes of scripts: the harnesses of fsmkit, and other forms of C.

They are also an option of a command line: names separated by commas.
"""

from __future__ import annotations

import click

from devtools.processors import CROSS, SANITIZED, SMALL
from fsmkit.diagnostics import FsmkitError
from fsmkit.testing.harness import harness as own
from fsmkit.testing.harness.harness import Harness


def harnesses() -> tuple[Harness, ...]:
    """Return the reference, a harness for each target that has one, and one of C for size."""
    return (*own.harnesses(), SMALL)


def harness(name: str) -> Harness:
    """Return the harness of a target, or of C in another form or on another processor.

    Raises:
        FsmkitError: The name is unknown.

    """
    return {SMALL.name: SMALL, **SANITIZED, **CROSS}.get(name) or own.harness(name)


def runtimes(_: click.Context, __: click.Parameter, value: str | None) -> tuple[str, ...]:
    """Return the names in the value of an option; none where it is not given.

    Raises:
        click.BadParameter: a name has no harness; the message lists those that have.

    """
    try:
        return tuple(harness(name.strip()).name for name in value.split(",")) if value else ()
    except FsmkitError as error:
        (found,) = error.diagnostics
        known = ", ".join((str(found.help), SMALL.name, *SANITIZED, *CROSS))
        raise click.BadParameter(f"{found.message}: {known}") from None
