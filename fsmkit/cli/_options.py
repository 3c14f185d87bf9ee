"""Options that several verbs have, and values of options that are told when they are wrong."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import wraps
from typing import Any

import click

from fsmkit.cli.console import WrongOptionError
from fsmkit.diagnostics import Findings, FsmkitError, Policy, Severity, rules
from fsmkit.diagnostics.nearest import nearest


class OneOf(click.Choice[str]):
    """A value out of a list; of any other one the error says what is probably meant.

    ``what`` is what a value is called: "there is no target `uml`".
    """

    def __init__(self, what: str, choices: Sequence[str]) -> None:
        """Keep what the values are called, and what there is."""
        super().__init__(choices)
        self.what = what

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the value if it is one of the list."""
        if value not in self.choices:
            self.fail(no_such(self.what, str(value), self.choices), param, ctx)
        return str(value)


def no_such(what: str, value: str, known: Sequence[str]) -> str:
    """Say that a value is unknown, what there is, and what is probably meant."""
    near = nearest(value, known)
    hint = "" if near is None else f"; did you mean `{near}`?"
    return f"there is no {what} `{value}`: {', '.join(known) or 'there is none'}{hint}"


@contextmanager
def option_value() -> Iterator[None]:
    """Make a diagnostic about the value of an option what it is: a wrong use, exit code 2."""
    try:
        yield
    except FsmkitError as error:
        raise WrongOptionError(error.diagnostics) from error


@dataclass(frozen=True, slots=True)
class Reading:
    """How charts are read and what is made of what is found: ``--strict --error --allow``."""

    strict: bool = False
    policy: Policy = field(default_factory=Policy)

    def findings(self) -> Findings:
        """Return an empty collection in which rules count as the options say."""
        return Findings(self.policy)


def reading_options(body: Callable[..., int]) -> Callable[..., int]:
    """Add ``--strict``, ``--error`` and ``--allow``; the verb gets them as ``reading``."""

    @click.option(
        "--strict",
        is_flag=True,
        help="What SCXML would make an error at run time is an error of the chart.",
    )
    @click.option(
        "--error",
        "errors",
        multiple=True,
        metavar="RULE",
        callback=_read_rules,
        help="Findings of this rule are errors; can be repeated.",
    )
    @click.option(
        "--allow",
        "allowed",
        multiple=True,
        metavar="RULE",
        callback=_read_allowed,
        help="Warnings and notes of this rule are not told; can be repeated.",
    )
    @wraps(body)
    def whole(
        *arguments: Any,
        strict: bool,
        errors: frozenset[str],
        allowed: frozenset[str],
        **more: Any,
    ) -> int:
        reading = Reading(strict, Policy(errors - allowed, allowed))
        return body(*arguments, reading=reading, **more)

    return whole


def _read_rules(
    ctx: click.Context, param: click.Parameter, value: tuple[str, ...]
) -> frozenset[str]:
    """Return the names of rules, given by name or by code."""
    known = {key: rule for rule in rules() for key in (rule.name, rule.code)}
    for given in value:
        if given not in known:
            near = nearest(given, known)
            hint = "`fsmkit explain` lists them" if near is None else f"did you mean `{near}`?"
            raise click.BadParameter(f"there is no rule `{given}`; {hint}", ctx, param)
    return frozenset(known[given].name for given in value)


def _read_allowed(
    ctx: click.Context, param: click.Parameter, value: tuple[str, ...]
) -> frozenset[str]:
    """Return the names of rules that can be allowed; an error cannot."""
    names = _read_rules(ctx, param, value)
    for rule in rules():
        if rule.name in names and rule.severity is Severity.ERROR:
            raise click.BadParameter(f"`{rule.name}` is an error, which stays one", ctx, param)
    return names
