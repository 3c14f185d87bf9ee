"""Format a campaign as rich text, and as data."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from fsmkit.emit.lines import one_line
from fsmkit.verify.campaign.jobs import VERDICTS, Job, Outcome
from fsmkit.verify.campaign.reader import Campaign

STYLES = {"holds": "green", "violated": "bold red", "undecided": "yellow", "error": "bold red"}
MOST = 40
"""Jobs that are shown one by one, of those that did not go well."""


@dataclass(frozen=True, slots=True)
class CampaignResult:
    """A campaign and its outcomes, by the keys of its jobs; a job without one was not done."""

    campaign: Campaign
    outcomes: Mapping[str, Outcome]

    def of(self, verdict: str) -> list[Job]:
        """Return the jobs with this verdict."""
        return [job for job in self.campaign.jobs if self.verdict_of(job) == verdict]

    def verdict_of(self, job: Job) -> str:
        """Return the verdict of a job; empty if it was not done."""
        return self.outcomes[job.key].verdict if job.key in self.outcomes else ""

    @property
    def verdict(self) -> str:
        """The worst verdict of all jobs."""
        verdicts = {self.verdict_of(job) for job in self.campaign.jobs}
        for worst in ("error", "violated", "undecided"):
            if worst in verdicts:
                return worst
        return "undecided" if "" in verdicts else "holds"


def summary(done: CampaignResult) -> RenderableType:
    """Return the jobs that did not succeed, a line for each run, and the total."""
    parts: list[RenderableType] = [*_bad(done), runs(done)]
    outcomes = [done.outcomes[j.key] for j in done.campaign.jobs if j.key in done.outcomes]
    states = sum(outcome.results.get("states", 0) for outcome in outcomes)
    seconds = sum(outcome.seconds for outcome in outcomes)
    missing = len(done.campaign.jobs) - len(outcomes)
    results = f"{len(outcomes):,} jobs, {states:,} states, {seconds:,.1f} s of work"
    parts.append(Text(results + (f"; {missing:,} not done" if missing else ""), "dim"))
    return Group(*parts)


def _bad(done: CampaignResult) -> Iterator[Text]:
    bad = [job for job in done.campaign.jobs if done.verdict_of(job) not in ("", "holds")]
    for job in bad[:MOST]:
        outcome = done.outcomes[job.key]
        yield Text.assemble(
            (outcome.verdict.upper(), STYLES[outcome.verdict]),
            f"  {job.kind} {one_line(job.label)}",
            (f"  {one_line(_reason(outcome))}", "dim"),
        )
    if len(bad) > MOST:
        yield Text(f"... and {len(bad) - MOST:,} more; --json has them all", "dim")


def _reason(outcome: Outcome) -> str:
    names = outcome.results.get("violated") or outcome.results.get("survivors") or ()
    names = names or outcome.results.get("divergences") or outcome.results.get("undecided") or ()
    return "; ".join([*map(str, names), *([outcome.why] if outcome.why else [])])


def runs(done: CampaignResult) -> Table:
    """Return a line for each run: its jobs by verdict, and its cost."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="dim")
    table.add_column("run")
    for heading in ("jobs", *VERDICTS, "states", "s"):
        table.add_column(heading, justify="right")
    for number, kind in enumerate(done.campaign.runs):
        jobs = [job for job in done.campaign.jobs if job.run == number]
        found = [done.outcomes[job.key] for job in jobs if job.key in done.outcomes]
        files = list(dict.fromkeys(job.short for job in jobs))
        what = files[0] if len(files) == 1 else f"{len(files)} files"
        counts = [sum(one.verdict == verdict for one in found) for verdict in VERDICTS]
        states = sum(one.results.get("states", 0) for one in found)
        table.add_row(
            Text(one_line(f"{kind} {what}")), f"{len(jobs):,}", *(f"{n:,}" for n in counts),
            f"{states:,}", f"{sum(one.seconds for one in found):,.1f}",
        )  # fmt: skip
    return table


def document(done: CampaignResult) -> Mapping[str, object]:
    """Return a campaign as data."""
    return {
        "campaign": done.campaign.name,
        "verdict": done.verdict,
        "jobs": [_job(done, job) for job in done.campaign.jobs],
        "counts": {verdict: len(done.of(verdict)) for verdict in VERDICTS},
        "missing": len(done.of("")),
    }


def _job(done: CampaignResult, job: Job) -> Mapping[str, object]:
    results: dict[str, object] = {"run": job.run, "kind": job.kind, "about": job.about}
    results |= {
        name: value for name, value in job.parameters.items() if value not in ("", [], {}, 0.0)
    }
    outcome = done.outcomes.get(job.key)
    if outcome is None:
        return results | {"verdict": None}
    reason = {"reason": outcome.why} if outcome.why else {}
    return results | {
        "verdict": outcome.verdict,
        "seconds": outcome.seconds,
        **reason,
        **outcome.results,
    }
