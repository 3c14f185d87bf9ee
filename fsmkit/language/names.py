"""The context of typing, and the report of unknown names."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from fsmkit.diagnostics import Findings, Fix, Severity, Span, Text
from fsmkit.diagnostics.fast_init import fast_init
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.language.scope import Scope
from fsmkit.language.types import EnumType, Type


@fast_init
@dataclass(frozen=True, slots=True)
class Context:
    """The visible names, and where to report findings."""

    scope: Scope
    findings: Findings

    @property
    def is_ecmascript(self) -> bool:
        """Return whether to keep ECMAScript's meaning, or else to report a finding."""
        return self.scope.dialect == "ecmascript"

    def report(
        self,
        rule: str,
        message: str,
        at: Span | Text,
        advice: str | None = None,
        severity: Severity | None = None,
        fixes: Iterable[Fix] = (),
    ) -> None:
        """Add a finding. Returns None, so that a caller can ``return context.report(...)``."""
        self.findings.add(rule, message, at, help=advice, severity=severity, fixes=fixes)


def kinds_of_name(scope: Scope) -> dict[str, str]:
    """Return a description of each name of a scope; a name with several meanings has the first."""
    found: dict[str, str] = dict.fromkeys(scope.variables, "a variable")
    for names, kind in (
        (scope.constants, "a constant"),
        (scope.operations, "an operation"),
        (scope.functions, "a function"),
        (scope.types, "a type"),
        (scope.states, "a state"),
        (scope.events, "an event"),
    ):
        for name in names:
            found.setdefault(name, kind)
    return found


def report_unknown(context: Context, name: str, span: Span, hint: Type | None = None) -> None:
    """Report that a name has no value here, and suggest a similar one."""
    scope = context.scope
    kind = kinds_of_name(scope).get(name)
    if kind in ("an operation", "a function"):
        message, advice = f"`{name}` is {kind}", f"call it: `{name}(...)`"
    elif kind == "a type":
        message, advice = f"`{name}` is a type", f"write one of its members: `{name}.member`"
    elif kind == "an event":
        message = f"`{name}` is an event, not a value"
        advice = "let a transition take it: its key under `on`, or `event` in SCXML"
    elif kind == "a state":
        message, advice = f"`{name}` is a state", f"test whether it is active: `In({name})`"
    else:
        message, advice = f"unknown name `{name}`", _suggest_name(scope, name, hint)
    context.report("unknown-name", message, span, advice)


def _suggest_name(scope: Scope, name: str, hint: Type | None) -> str:
    for type_ in scope.types.values():
        if isinstance(type_, EnumType) and name in type_.members:
            return f"did you mean `{type_.name}.{name}`?"
    if scope.event_fields is not None and name in scope.event_fields:
        return f"did you mean `event.{name}`?"
    members = hint.members if isinstance(hint, EnumType) else ()
    known = (*scope.variables, *scope.constants, *members, *scope.operations, *scope.functions)
    declare = "declare it under `data`, `inputs`, `outputs` or `constants`"
    return suggest(name, known, declare) or declare
