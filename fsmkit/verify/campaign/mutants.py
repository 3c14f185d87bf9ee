"""Mutants as jobs: their fates are kept in a ledger, from which another run continues."""

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
    """The mutants of the first of several systems, evaluated by all of them.

    A stored fate is valid as long as the sources of the systems and the exploration options are the
    same.
    """

    ledger: Ledger
    known: Mapping[str, Outcome]
    subjects: Sequence[Subject]
    parameters: Mapping[str, Any]
    content: str

    @staticmethod
    def of(
        folder: Path | None,
        subjects: Sequence[Subject],
        options: ExplorationOptions,
        properties: frozenset[str],
    ) -> KeptMutants:
        """Open the ledger of a folder; None: nothing is stored, and nothing known."""
        ledger = Ledger(folder)
        parameters = {
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
        return KeptMutants(ledger, ledger.known(), subjects, parameters, _content(subjects))

    def recall(self, mutant: Mutant) -> Evaluated | None:
        """Return the stored fate of a mutant; None if it is unknown."""
        outcome = self.known.get(self._job(mutant).key)
        return None if outcome is None else _read(outcome, mutant)

    def keep(self, one: Evaluated) -> None:
        """Store a fate. Raises `FsmkitError` if that fails. Failed mutants are tried again."""
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
        return Job(0, "mutants", path.name, {**self.parameters, "change": change}, self.content)


def _content(subjects: Sequence[Subject]) -> str:
    """Return a hash of the sources of some systems."""
    texts = [source.text for subject in subjects for source in sources_of(subject.system)]
    return hashlib.sha256("\0".join(texts).encode("utf-8", "replace")).hexdigest()[:16]


def _read(outcome: Outcome, mutant: Mutant) -> Evaluated | None:
    """Return the fate in an outcome; None if `keep` did not write the outcome."""
    results = outcome.results
    try:
        contrast = results["contrast"]
        return Evaluated(
            mutant,
            Fate(results["fate"]),
            tuple(results["by"]),
            outcome.why,
            results["states"],
            tuple(results["systems"]),
            None if contrast is None else Contrast.read(contrast),
        )
    except (KeyError, TypeError, ValueError):
        return None
