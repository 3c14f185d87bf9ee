"""Options that several verbs have, and the errors for their values."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.core import ParameterSource

from fsmkit.cli.common.console import WrongOptionError
from fsmkit.diagnostics import Findings, FsmkitError, Policy, Severity, rules
from fsmkit.diagnostics.suggestions import nearest_name
from fsmkit.document.front_ends import SELECTED
from fsmkit.document.python_objects import is_reference

if TYPE_CHECKING:
    from fsmkit.document.project import Project


Verb = TypeVar("Verb", bound=Callable[..., Any])


class OneOf(click.Choice[str]):
    """A value of a list; the error for any other value suggests the nearest one.

    ``what`` is the kind of value: "there is no target `uml`".
    """

    def __init__(self, what: str, choices: Sequence[str]) -> None:
        """Store the kind of value, and the permitted values."""
        super().__init__(choices)
        self.what = what

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the value if it is one of the list."""
        if value not in self.choices:
            self.fail(no_such(self.what, str(value), self.choices), param, ctx)
        return str(value)


def no_such(what: str, value: str, known: Sequence[str]) -> str:
    """Return the message for an unknown value, with the known ones and a suggestion."""
    near = nearest_name(value, known)
    hint = "" if near is None else f"; did you mean `{near}`?"
    return f"there is no {what} `{value}`: {', '.join(known) or 'none exists'}{hint}"


def path_option(*names: str, **settings: Any) -> Callable[[Verb], Verb]:
    """Return an option whose value is a path; the settings are those of `click.option`."""
    return click.option(*names, type=click.Path(path_type=Path), **settings)


@contextmanager
def option_value() -> Iterator[None]:
    """Convert a diagnostic about the value of an option to a usage error, exit code 2."""
    try:
        yield
    except FsmkitError as error:
        raise WrongOptionError(error.diagnostics) from error


@dataclass(frozen=True, slots=True)
class Reading:
    """The options for reading charts and for the severity of findings.

    ``--strict --error --allow --set``.
    """

    strict: bool = False
    policy: Policy = field(default_factory=Policy)
    parameters: Mapping[str, str] = field(default_factory=dict)

    def of(self, file: Path) -> Reading:
        """Return the settings for a file: those of its project, overridden by options.

        Raises `FsmkitError` with the errors of the project file.
        """
        from fsmkit.document.project import (  # `fsmkit --help` needs no language
            project_of,
            with_levels,
        )

        project = None if is_reference(str(file)) else project_of(file)
        return replace(self, policy=with_levels(self.policy, project))

    def findings(self) -> Findings:
        """Return an empty collection with the severities that the options set."""
        return Findings(self.policy)


def reading_options(body: Callable[..., int]) -> Callable[..., int]:
    """Add ``--strict``, ``--error``, ``--allow``, ``--set``; the verb has them in ``reading``.

    ``--machine`` is added, too; it selects one of the machines of a file of another tool.
    """

    @click.option("--machine", metavar="NAME", help="Read this machine of a file with several.")
    @click.option(
        "--set",
        "parameters",
        multiple=True,
        metavar="NAME=VALUE",
        callback=_read_parameters,
        help="Set a parameter or constant; repeatable.",
    )
    @click.option(
        "--strict",
        is_flag=True,
        help="Reject what SCXML treats as an error at run time.",
    )
    @click.option(
        "--error",
        "errors",
        multiple=True,
        metavar="RULE",
        callback=_read_rules,
        help="Treat findings of this rule as errors; repeatable.",
    )
    @click.option(
        "--allow",
        "allowed",
        multiple=True,
        metavar="RULE",
        callback=_read_allowed,
        help="Suppress warnings and notes of this rule; repeatable.",
    )
    @wraps(body)
    def whole(
        *arguments: Any,
        strict: bool,
        errors: frozenset[str],
        allowed: frozenset[str],
        parameters: dict[str, str],
        machine: str | None,
        **more: Any,
    ) -> int:
        SELECTED.set(replace(SELECTED.get(), machine=machine))
        reading = Reading(strict, Policy(errors - allowed, allowed), parameters)
        named = more.get("file") or next(iter(more.get("files") or ()), None)
        if isinstance(named, Path):
            reading = reading.of(named)
        return body(*arguments, reading=reading, **more)

    return whole


def value_or_default(context: click.Context, name: str, value: Any, given: str | None) -> Any:
    """Return the value of an option, by default that of the project file.

    ``given``: the source in the project file, or None.
    """
    source = context.get_parameter_source(name)
    if given is None or source not in (ParameterSource.DEFAULT, None):
        return value
    option = next(one for one in context.command.params if one.name == name)
    return option.process_value(context, given)


def project_for(files: Sequence[Path]) -> Project | None:
    """Return the project of the first of some files."""
    plain = [file for file in files[:1] if not is_reference(str(file))]
    from fsmkit.document.project import project_of

    return project_of(plain[0]) if plain else None


def _read_parameters(
    ctx: click.Context, param: click.Parameter, value: tuple[str, ...]
) -> dict[str, str]:
    """Read ``N=8``."""
    found: dict[str, str] = {}
    for text in value:
        name, equals, given = text.partition("=")
        if not (name.strip() and equals and given.strip()) or name.strip() in found:
            raise click.BadParameter(f"`{text}` is not `NAME=VALUE`, once", ctx, param)
        found[name.strip()] = given.strip()
    return found


def _read_rules(
    ctx: click.Context, param: click.Parameter, value: tuple[str, ...]
) -> frozenset[str]:
    """Return the names of rules, given by name or by code."""
    known = {key: rule for rule in rules() for key in (rule.name, rule.code)}
    for given in value:
        if given not in known:
            near = nearest_name(given, known)
            hint = "`fsmkit explain` lists them" if near is None else f"did you mean `{near}`?"
            raise click.BadParameter(f"rule `{given}` does not exist; {hint}", ctx, param)
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


# --- sizes, spans of time, charts in place of others ----------------------------------------------


def read_size(ctx: click.Context, param: click.Parameter, value: str) -> int:
    """Read ``4G``, ``512M`` as bytes."""
    from fsmkit.document.project.quantities import size_of

    found = size_of(value)
    if found is None:
        raise click.BadParameter(f"`{value}` is not a size such as 4G or 512M", ctx, param)
    return found


def read_span(ctx: click.Context, param: click.Parameter, value: str) -> float:
    """Read ``10m``, ``30s`` as seconds."""
    from fsmkit.document.project.quantities import seconds_of

    found = seconds_of(value)
    if found is None:
        raise click.BadParameter(
            f"`{value}` is not a duration such as 30s or 10m; units are ms, s, m, h", ctx, param
        )
    return found


def read_max_pending(ctx: click.Context, param: click.Parameter, value: str | None) -> int | None:
    """Read a number of events, or ``none`` as no limit."""
    if value is None:
        return None
    from fsmkit.verify.statespace.closed_system import UNLIMITED

    if value == "none":
        return UNLIMITED
    if not value.isdecimal() or int(value) >= UNLIMITED:
        raise click.BadParameter(
            f"`{value}` is not a number of events; `none`: no limit", ctx, param
        )
    return int(value)


def read_replacements(
    ctx: click.Context, param: click.Parameter, value: tuple[str, ...]
) -> dict[str, Path]:
    """Read ``feeder=other.yaml``."""
    found: dict[str, Path] = {}
    for text in value:
        name, equals, path = text.partition("=")
        if not (name and equals and path) or name in found:
            raise click.BadParameter(f"`{text}` is not `MACHINE=CHART`, once", ctx, param)
        found[name] = Path(path)
    return found


SILENT = click.option(
    "--assume-watchdogs-silent",
    "silent",
    is_flag=True,
    help="Never fire transitions marked `watchdog` (untimed only).",
)
TIMEOUT = click.option(
    "--timeout",
    metavar="DURATION",
    callback=read_span,
    default="0",
    help="Stop after this much time, such as 30s or 10m.",
)
REPLACE = click.option(
    "--replace",
    "replacing",
    multiple=True,
    callback=read_replacements,
    metavar="MACHINE=CHART",
    help="Run this chart in a machine of the system; repeatable.",
)
