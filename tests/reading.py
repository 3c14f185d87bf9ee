"""What tests read of texts and files, and what is found in them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import fsmkit
from fsmkit.diagnostics import Diagnostic, Severity, Span, Text
from fsmkit.system.deployment.deployment import Deployment


@dataclass(frozen=True)
class Found:
    """What was found."""

    found: tuple[Diagnostic, ...]

    @property
    def messages(self) -> list[str]:
        """The messages of all findings."""
        return [d.message for d in self.found]

    @property
    def rules(self) -> list[str]:
        """Names of the rules found, in order."""
        return [d.rule.name for d in self.found]

    @property
    def errors(self) -> list[str]:
        """Names of the rules found that are errors."""
        return [d.rule.name for d in self.found if d.severity is Severity.ERROR]

    @property
    def marked(self) -> list[str]:
        """The texts that the findings underline."""
        return [underlined(d.primary.span) for d in self.found if d.primary]

    def one(self, rule: str) -> Diagnostic:
        """Return the only finding of that rule."""
        (found,) = (d for d in self.found if d.rule.name == rule)
        return found


def underlined(at: Span | Text) -> str:
    """Return the source text at a place."""
    span = at.span if isinstance(at, Text) else at
    return span.source.text[span.start : span.end]


def charts_of_machines() -> list[Path]:
    """Return the files of charts in YAML in the folder `machines`."""
    return sorted(
        path
        for path in (Path(__file__).parents[1] / "machines").rglob("*.yaml")
        if not path.name.endswith(".test.yaml")
        if "\nsystem:" not in f"\n{path.read_text()}" and not path.name.endswith(".io.yaml")
    )


def load_deployment(path: Path) -> Deployment:
    """Read a deployment."""
    found = fsmkit.read(path)
    assert isinstance(found, Deployment)
    return found
