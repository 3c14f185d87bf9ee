"""A finding of a stage: a rule, a message, locations and a fix."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field, replace

from fsmkit.diagnostics.allow_comments import is_hidden
from fsmkit.diagnostics.fixes import Fix, replace_wrong_name
from fsmkit.diagnostics.rules import Rule, Severity, rule
from fsmkit.diagnostics.source import Span, Text
from fsmkit.diagnostics.suggestions import NameSuggestion


@dataclass(frozen=True, slots=True)
class Label:
    """A remark on a location."""

    span: Span
    text: str = ""


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One finding: what is wrong, where, related locations, and how to fix it.

    ``primary`` is None only if no source contains the problem (a missing file, a tool).
    """

    rule: Rule
    message: str
    primary: Label | None = None
    secondary: tuple[Label, ...] = ()
    help: str | None = None
    severity: Severity = field(default=Severity.ERROR)
    fixes: tuple[Fix, ...] = field(default=(), compare=False, repr=False)


class FsmkitError(Exception):
    """The one exception of fsmkit. It holds the findings."""

    def __init__(self, diagnostics: Iterable[Diagnostic]) -> None:
        """Store the findings, errors and warnings alike, in the order found."""
        self.diagnostics = tuple(diagnostics)
        super().__init__(self.diagnostics)

    def __str__(self) -> str:
        return "\n\n".join(render(d) for d in self.diagnostics)


@dataclass(frozen=True, slots=True)
class Policy:
    """The severities that a user sets for rules, by name.

    Only warnings and notes can be allowed, by name here or by a comment at the location. An error
    stays an error.
    """

    errors: frozenset[str] = frozenset()
    allowed: frozenset[str] = frozenset()
    warnings: frozenset[str] = frozenset()
    notes: frozenset[str] = frozenset()

    def apply(self, diagnostic: Diagnostic) -> Diagnostic | None:
        """Return a finding with its effective severity, or None if its rule is allowed."""
        if diagnostic.severity is Severity.ERROR:
            return diagnostic
        name, at = diagnostic.rule.name, diagnostic.primary
        if name in self.allowed or (at is not None and is_hidden(diagnostic.rule, at.span)):
            return None
        if name in self.errors:
            return replace(diagnostic, severity=Severity.ERROR)
        if name in self.warnings:
            return replace(diagnostic, severity=Severity.WARNING)
        if name in self.notes:
            return replace(diagnostic, severity=Severity.NOTE)
        return diagnostic


class Findings:
    """The diagnostics of a stage, collected so that all are reported before it stops."""

    def __init__(self, policy: Policy | None = None) -> None:
        """Start without findings; `policy` applies to every finding that is added."""
        self._policy = policy or Policy()
        self._found: dict[Diagnostic, None] = {}

    def __iter__(self) -> Iterator[Diagnostic]:
        return iter(self._found)

    def __len__(self) -> int:
        return len(self._found)

    def escalate(self, rules: Collection[str]) -> None:
        """Turn the findings of some rules into errors."""
        self._found = {
            (replace(d, severity=Severity.ERROR) if d.rule.name in rules else d): None
            for d in self._found
        }

    def add(
        self,
        rule_name: str,
        message: str,
        at: Span | Text | None,
        *,
        label: str = "",
        secondary: Iterable[tuple[Span | Text, str]] = (),
        help: str | None = None,  # noqa: A002  (the word of every compiler's diagnostics)
        severity: Severity | None = None,
        fixes: Iterable[Fix] = (),
    ) -> None:
        """Add a finding of rule `rule_name` at a location, unless it is already present.

        ``severity`` overrides the rule's own. If ``help`` suggests a name, the finding gets a fix
        that writes this name.
        """
        kind = rule(rule_name)
        if isinstance(help, NameSuggestion) and at is not None:
            fixes = (*fixes, *replace_wrong_name(help.name, at, help.wrong))
        diagnostic = Diagnostic(
            kind,
            message,
            None if at is None else Label(_span(at), label),
            tuple(Label(_span(place), text) for place, text in secondary),
            None if help is None else str(help),
            severity or kind.severity,
            tuple(fixes),
        )
        self.extend((diagnostic,))

    def extend(self, diagnostics: Iterable[Diagnostic]) -> None:
        """Add the findings of another stage, subject to the policy."""
        counted = map(self._policy.apply, diagnostics)
        self._found.update((diagnostic, None) for diagnostic in counted if diagnostic is not None)

    @property
    def has_errors(self) -> bool:
        """Return whether the pipeline must stop after this stage."""
        return any(d.severity is Severity.ERROR for d in self._found)

    def stop_on_errors(self) -> None:
        """Raise `FsmkitError` with all findings if one of them is an error."""
        if self.has_errors:
            raise FsmkitError(self._found)


def _span(at: Span | Text) -> Span:
    return at.span if isinstance(at, Text) else at


def fail(
    rule_name: str,
    message: str,
    at: Span | Text | None = None,
    *,
    help: str | None = None,  # noqa: A002  (the word of every compiler's diagnostics)
) -> FsmkitError:
    """Return the error to raise for a finding that ends the stage."""
    findings = Findings()
    findings.add(rule_name, message, at, help=help)
    return FsmkitError(findings)


# --- as text, in the format of rustc and ruff -----------------------------------------------------

WIDEST = 160
"""A longer source line is cut around the location, in characters."""


def render(diagnostic: Diagnostic) -> str:
    """Return the full, multi-line form of a diagnostic."""
    return "\n".join(_lines(diagnostic))


def _lines(diagnostic: Diagnostic) -> Iterator[str]:
    head = f"{diagnostic.severity.value}[{diagnostic.rule.code}]"
    yield f"{head} {diagnostic.rule.name}: {diagnostic.message}"
    labels = [*([diagnostic.primary] if diagnostic.primary else []), *diagnostic.secondary]
    numbers = [label.span.source.position(label.span.start)[0] for label in labels]
    gutter = " " * len(str(max(numbers, default=0)))
    for label in labels:
        first = label is diagnostic.primary
        yield from _snippet(label, "-->" if first else ":::", "^" if first else "-", gutter)
    if diagnostic.help is not None:
        yield f"{gutter} = help: {diagnostic.help}"


def _snippet(label: Label, arrow: str, mark: str, gutter: str) -> Iterator[str]:
    source, span = label.span.source, label.span
    line, column = source.position(span.start)
    text = source.line(line)
    width = max(1, min(span.end - span.start, len(text) - column + 1))
    yield f"{gutter}{arrow} {source.name}:{line}:{column}"
    cut = max(0, column - 1 - WIDEST // 2) if len(text) > WIDEST else 0
    shown = text[cut : cut + WIDEST].expandtabs(1)
    width = max(1, min(width, len(shown) - (column - 1 - cut)))
    yield f"{gutter} |"
    yield f"{line:>{len(gutter)}} | {_printable(shown)}"
    yield f"{gutter} | {' ' * (column - 1 - cut)}{mark * width} {label.text}".rstrip()


def _printable(text: str) -> str:
    return "".join(char if char.isprintable() else "\N{REPLACEMENT CHARACTER}" for char in text)
