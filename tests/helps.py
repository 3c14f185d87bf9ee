"""A law of each command line that a test runs: a help names no option that the verb lacks."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import click
import pytest

from fsmkit.cli import Verbs, cli
from fsmkit.cli.common import console
from fsmkit.diagnostics import Diagnostic, render

OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*")
OF_ALL = ("--help",)


def options_of(verb: str) -> frozenset[str]:
    """Return the options of a verb; none where there is no such verb."""
    assert isinstance(cli, Verbs)
    command = cli.get_command(click.Context(cli), verb)
    params = () if command is None else command.params
    own = (o for p in params if isinstance(p, click.Option) for o in (*p.opts, *p.secondary_opts))
    return frozenset((*own, *OF_ALL))


def named_options(text: str) -> Iterator[tuple[str, str]]:
    """Yield each option that a text names, after the verb that it stands behind, or ``""``.

    Of a quoted option the argument is passed over, which may be a command line of the user's; so
    are quoted command lines of other programs.
    """
    for number, part in enumerate(text.split("`")):
        words = part.split()
        if number % 2 == 0:
            yield from (("", option) for option in OPTION.findall(part))
        elif words[:1] == ["fsmkit"]:
            yield from ((words[1], option) for option in OPTION.findall(part))
        elif words and (found := OPTION.match(words[0])):
            yield "", found[0]


def lacking(text: str, verb: str) -> list[str]:
    """Return the options that a text names and the verb lacks, that at hand or the named one."""
    return [o for named, o in named_options(text) if o not in options_of(named or verb)]


def watch(patch: pytest.MonkeyPatch) -> None:
    """Let a test fail where a finding is printed whose help the verb at hand cannot follow."""
    at_hand: list[str] = []
    resolve = Verbs.resolve_command

    def resolving(self: Verbs, ctx: click.Context, args: list[str]) -> Any:
        at_hand[:] = args[:1]
        return resolve(self, ctx, args)

    def rendering(diagnostic: Diagnostic) -> str:
        wrong = lacking(diagnostic.help or "", at_hand[0]) if at_hand else []
        assert not wrong, f"`{at_hand[0]}` has no {' and no '.join(wrong)}: {diagnostic.help}"
        return render(diagnostic)

    patch.setattr(Verbs, "resolve_command", resolving)
    patch.setattr(console, "render", rendering)
