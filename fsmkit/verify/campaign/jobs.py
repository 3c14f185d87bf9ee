"""Jobs: the units of a campaign, as data that travels to a worker, and what comes of them."""

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

    ``run``: its place in the file, from 0. ``kind``: check, mutants, swarm, differential or fuzz.
    ``about``: a file, or what is compared. ``asked``: all else that it depends on, as data.
    ``content``: what tells apart the texts that it reads.
    """

    run: int
    kind: str
    about: str
    asked: Mapping[str, Any] = field(default_factory=dict)
    content: str = ""

    @property
    def key(self) -> str:
        """What names it: a job with the same key has the same result."""
        text = json.dumps({**asdict(self), "run": 0}, sort_keys=True)
        return f"{self.kind}-{hashlib.sha256(text.encode()).hexdigest()[:24]}"

    @property
    def label(self) -> str:
        """What it does, for people."""
        told = {name: value for name, value in self.asked.items() if name in SHOWN and value}
        values = {**dict(told.pop("set", {})), **told}
        words = ", ".join(f"{name}={value}" for name, value in values.items())
        return f"{self.short} ({words})" if words else self.short

    @property
    def short(self) -> str:
        """The name of its file, or what is compared."""
        return Path(self.about).name


SHOWN = ("set", "seed", "first", "seconds")


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of a job.

    ``verdict``: ``holds``, ``violated``, ``undecided``, or ``error`` where there is none.
    ``told``: figures and what was found, as data. ``seconds``: that it took where it was done.
    """

    key: str
    verdict: str
    why: str = ""
    seconds: float = 0.0
    told: Mapping[str, Any] = field(default_factory=dict)


VERDICTS = ("holds", "violated", "undecided", "error")
