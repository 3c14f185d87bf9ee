"""The context of content: the scope of its names, and the treatment of errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from fsmkit.chart.copies.splicing import Spliced
from fsmkit.chart.passes.collect_events import Events
from fsmkit.diagnostics import Findings, Span
from fsmkit.language import Scope, Type

REPLACING = frozenset({"content-not-evaluable", "unsupported-invoke"})
"""Rules of findings by which a place becomes an error at run time."""


@dataclass(frozen=True, slots=True)
class Context:
    """The context of a block: the scope of its names, and the treatment of errors.

    In a ``lenient`` dialect, content that cannot be evaluated raises ``error.execution`` at run
    time and is a warning at compile time. ``scope.event_fields`` holds the current event's fields.
    """

    scope: Scope
    events: Events
    findings: Findings
    lenient: bool
    replies: tuple[Type, ...] = ()
    """The declared answers of the possible current events, for ``reply``."""
    invoked: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    """The invocations that are reached under a target."""
    invoker: frozenset[str] = frozenset()
    """The targets that mean the machine that invokes this one."""

    copies: Spliced | None = None
    """The copies in the chart, with the mapping of their names."""

    def at(self, state: int) -> Context:
        """Return the context of content of a state: an index of copies, values of an exit."""
        place = None if self.copies is None else self.copies.places.get(state)
        if place is None:
            return self
        scope = replace(
            self.scope,
            constants={**self.scope.constants, **place.constants},
            indices=frozenset(place.constants),
            copies={**self.scope.copies, **(place.exit or {})},
            copied=self.scope.copied | ({"exit"} if place.exit is not None else set()),
        )
        return replace(self, scope=scope)

    @property
    def is_loose(self) -> bool:
        """Whether the dialect declares nothing, as SCXML does."""
        return self.scope.dialect != "fsmkit"


def warn_not_evaluable(
    reason: str, span: Span, findings: Findings, advice: str | None = None
) -> None:
    """Say that content is an error at run time, as the standard wants it.

    ``advice``: the way out that the error would have in a strict dialect.
    """
    what = "at run time it is `error.execution`; `--strict` makes it an error now"
    if advice is not None:
        is_asked = advice.endswith("?")
        what = f"{advice} A{what[1:]}" if is_asked else f"{advice}; {what}"
    findings.add(
        "content-not-evaluable",
        f"this cannot be evaluated: {reason}",
        span,
        help=what,
    )
