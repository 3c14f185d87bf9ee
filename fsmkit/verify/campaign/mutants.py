"""Mutants as jobs: what became of each is kept in a ledger, and another run goes on from there."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fsmkit.system.any_file import sources_of
from fsmkit.verify.campaign.jobs import Job, Outcome
from fsmkit.verify.campaign.ledger import Ledger
from fsmkit.verify.explore import ExplorationOptions
from fsmkit.verify.mutants.contrast import Contrast
from fsmkit.verify.mutants.fates import Evaluated, Fate
from fsmkit.verify.mutants.subject import Mutant, Subject

VERDICTS = {
    Fate.FOUND: "holds",
    Fate.EQUIVALENT: "holds",
    Fate.SURVIVING: "violated",
    Fate.UNDECIDED: "undecided",
}


@dataclass(frozen=True)
class KeptMutants:
    """Those of the first of some systems, evaluated by all of them.

    What is known of one counts as long as the texts of the systems, and how they are explored,
    are the same.
    """

    ledger: Ledger
    known: Mapping[str, Outcome]
    subjects: Sequence[Subject]
    asked: Mapping[str, Any]
    content: str

    @staticmethod
    def of(
        folder: Path | None,
        subjects: Sequence[Subject],
        options: ExplorationOptions,
        properties: frozenset[str],
    ) -> KeptMutants:
        """Read the ledger of a folder; None: nothing is kept, and nothing known."""
        ledger = Ledger(folder)
        asked = {
            "time": options.time,
            "silent": options.assume_watchdogs_silent,
            "engine": options.engine,
            "memory": options.memory,
            "storage": options.storage.value,
            "search": options.search.value,
            "max_pending": options.max_pending,
            "properties": sorted(properties),
            "set": [dict(subject.parameters) for subject in subjects],
        }
        return KeptMutants(ledger, ledger.known(), subjects, asked, _content(subjects))

    def recall(self, mutant: Mutant) -> Evaluated | None:
        """Return what became of a mutant earlier."""
        outcome = self.known.get(self._job(mutant).key)
        return None if outcome is None else _read(outcome, mutant)

    def keep(self, one: Evaluated) -> None:
        """Keep it; `FsmkitError` where that cannot be done. What failed is tried again."""
        verdict = "error" if one.failed else VERDICTS[one.fate]
        self.ledger.keep(Outcome(self._job(one.mutant).key, verdict, one.why, 0.0, {
            "mutant": f"{one.mutant.machine}, {one.mutant.operator}: {one.mutant.what}",
            "fate": one.fate.value,
            "by": list(one.by),
            "states": one.states,
            "systems": list(one.systems),
            "contrast": None if one.contrast is None else one.contrast.as_json(),
        }))  # fmt: skip

    def _job(self, mutant: Mutant) -> Job:
        path = self.subjects[0].path
        change = {"machine": mutant.machine, "operator": mutant.operator, "what": mutant.what}
        if mutant.place is not None and mutant.documents is not None:
            file = os.path.relpath(mutant.place.source.name, path.parent)
            change |= {"file": Path(file).as_posix(), "at": str(mutant.place.start)}
        return Job(0, "mutants", path.name, {**self.asked, "change": change}, self.content)


def _content(subjects: Sequence[Subject]) -> str:
    """Return a hash of all texts of some systems."""
    texts = [source.text for subject in subjects for source in sources_of(subject.system)]
    return hashlib.sha256("\0".join(texts).encode("utf-8", "replace")).hexdigest()[:16]


def _read(outcome: Outcome, mutant: Mutant) -> Evaluated | None:
    """Return what an outcome tells of a mutant; None where it was not written by `keep`."""
    told = outcome.told
    try:
        contrast = told["contrast"]
        return Evaluated(
            mutant,
            Fate(told["fate"]),
            tuple(told["by"]),
            outcome.why,
            told["states"],
            tuple(told["systems"]),
            None if contrast is None else Contrast.read(contrast),
        )
    except (KeyError, TypeError, ValueError):
        return None
