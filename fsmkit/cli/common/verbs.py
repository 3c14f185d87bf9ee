"""Verbs: commands whose options are grouped by headings, and their common options."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from fsmkit.cli.common.console import set_up
from fsmkit.cli.common.options import OneOf


@dataclass
class Options:
    """The values of the options common to all verbs."""

    sarif: Path | None = None


def _set_up(ctx: click.Context, param: click.Parameter, value: object) -> None:
    """Configure the streams; called for each of the common options."""
    talk: dict[str, object] = ctx.meta.setdefault("fsmkit.talk", {})
    talk[str(param.name)] = value
    verbosity = -1 if talk.get("quiet") else 1 if talk.get("verbose") else 0
    set_up(str(talk.get("color", "auto")), verbosity)


def _keep_sarif(ctx: click.Context, param: click.Parameter, value: Path | None) -> None:
    del param
    options = ctx.find_object(Options)
    if options is not None and value is not None:
        options.sarif = value


def everywhere() -> tuple[click.Option, ...]:
    """Return the options of every verb."""
    return (
        click.Option(
            ["-q", "--quiet"],
            is_flag=True,
            expose_value=False,
            callback=_set_up,
            help="Print only errors and results.",
        ),
        click.Option(
            ["-v", "--verbose"],
            is_flag=True,
            expose_value=False,
            callback=_set_up,
            help="Print the explanation of each finding, too.",
        ),
        click.Option(
            ["--color"],
            type=OneOf("colouring", ("auto", "always", "never")),
            default="auto",
            expose_value=False,
            callback=_set_up,
            help="Print in colours: on terminals (default), always or never.",
        ),
        click.Option(
            ["--sarif"],
            type=click.Path(path_type=Path),
            expose_value=False,
            callback=_keep_sarif,
            help="Write the findings as SARIF, too.",
        ),
    )


FINDINGS = ("strict", "errors", "allowed", "is_fixing", "quiet", "verbose", "color", "sarif")
"""Names of the parameters under the last heading of every verb."""


MOVED = {
    "check --refines": "fsmkit refine CHART BASE",
    "check --mutants": "fsmkit mutants FILE --sample N",
    "check --cover": "fsmkit cover FILE --out FOLDER",
    "check --spin-trail": "fsmkit export FILE --to promela --replay-trail MODEL",
    "check --patience": "--max-pending",
    "export --most": "--max-states",
}
"""Options of earlier versions, after their verb, and their replacements."""
COLUMN = 34
"""The widest option with its help on the same line."""


class Verb(click.Command):
    """A verb. ``headings``: parameters by heading; the others are listed first."""

    def __init__(self, name: str, *, headings: Mapping[str, Sequence[str]], **more: Any) -> None:
        """Add the common options, and store the heading of each option."""
        super().__init__(name, **more)
        own = {parameter.name for parameter in self.params}
        self.params += [option for option in everywhere() if option.name not in own]
        by_heading = {**headings, "Findings": FINDINGS}
        self.heading_of = {name: title for title, names in by_heading.items() for name in names}

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Read the command line; an error about an earlier option names the new one."""
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            new = MOVED.get(f"{ctx.info_name} {error.option_name}")
            if new is None:
                raise
            message = f"No such option: {error.option_name}. Write `{new}` instead."
            raise click.UsageError(message, ctx) from error

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options: first those without a heading."""
        titles = ("Options", *dict.fromkeys(self.heading_of.values()))
        records: dict[str, list[tuple[str, str]]] = {title: [] for title in titles}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            if record is not None and isinstance(parameter, click.Option):
                records[self.heading_of.get(str(parameter.name), "Options")].append(record)
        widths = [len(option) for rows in records.values() for option, _ in rows]
        width = max(w for w in widths if w <= COLUMN)
        for title, rows in records.items():
            if rows:
                with formatter.section(title):
                    formatter.write_dl([(o.ljust(width), text) for o, text in rows], width)


def verb(epilog: str, **headings: Sequence[str]) -> Callable[[Callable[..., int]], Verb]:
    """Return the decorator that makes a function a verb.

    Args:
        epilog: The examples, printed last.
        headings: Names of parameters by heading, in which ``_`` is a blank.

    """
    titles = {title.replace("_", " "): names for title, names in headings.items()}
    return click.command(cls=Verb, epilog=epilog, headings=titles)
