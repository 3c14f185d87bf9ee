"""Jobs, the units of a campaign, and their outcomes: plain data that can be sent to a worker."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any


@dataclass(frozen=True, slots=True)
class Job:
    """One unit of work.

    ``run``: its index in the file, from 0. ``kind``: check, mutants, swarm, differential or fuzz.
    ``about``: a file, or the compared target. ``parameters``: its other parameters, as data.
    ``content``: a hash of the sources that it reads.
    """

    run: int
    kind: str
    about: str
    parameters: Mapping[str, Any] = field(default_factory=dict)
    content: str = ""

    @property
    def key(self) -> str:
        """The identity: jobs with the same key have the same result."""
        text = json.dumps({**asdict(self), "run": 0}, sort_keys=True)
        return f"{self.kind}-{hashlib.sha256(text.encode()).hexdigest()[:24]}"

    @property
    def label(self) -> str:
        """A description for people."""
        results = {
            name: value for name, value in self.parameters.items() if name in SHOWN and value
        }
        values = {**dict(results.pop("set", {})), **results}
        words = ", ".join(f"{name}={value}" for name, value in values.items())
        return f"{self.short} ({words})" if words else self.short

    @property
    def short(self) -> str:
        """The name of its file, or the compared target."""
        return Path(self.about).name


SHOWN = ("set", "seed", "first", "seconds")


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of a job.

    ``verdict``: ``holds``, ``violated``, ``undecided``, or ``error`` without a verdict.
    ``results``: figures and findings, as data. ``seconds``: its duration on its worker.
    """

    key: str
    verdict: str
    why: str = ""
    seconds: float = 0.0
    results: Mapping[str, Any] = field(default_factory=dict)


VERDICTS = ("holds", "violated", "undecided", "error")
