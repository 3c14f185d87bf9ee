"""``fsmkit campaign``: many checks on many processors."""

from __future__ import annotations

from pathlib import Path

import click

from fsmkit.cli.common.console import print_json, progress, report, result
from fsmkit.cli.common.options import Reading
from fsmkit.cli.common.verbs import verb
from fsmkit.verify.campaign.ledger import Ledger
from fsmkit.verify.campaign.pool import perform_jobs
from fsmkit.verify.campaign.reader import read_campaign
from fsmkit.verify.campaign.show import CampaignResult, document, summary

EPILOG = """\b
Examples:
  fsmkit campaign night.yaml
  fsmkit campaign night.yaml --workers 8 --resume night
  fsmkit campaign night.yaml --scheduler tcp://10.0.0.1:8786 --json
"""


@verb(EPILOG)
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Send the jobs to this Dask scheduler, such as tcp://10.0.0.1:8786.",
)
@click.option(
    "--workers",
    type=click.IntRange(min=0),
    default=0,
    show_default="one for each core",
    help="Run this many jobs at once on this machine.",
)
@click.option(
    "--resume",
    "folder",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="FOLDER",
    help="Keep results in this folder, and run only jobs without one.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def command(
    file: Path, scheduler: str | None, workers: int, folder: Path | None, as_json: bool
) -> int:
    """Run many checks, mutants, searches and comparisons.

    If a worker dies, another one repeats its job. Exit code 1: a job is violated, undecided,
    differs or failed, or a mutant survives.
    """
    findings = Reading().of(file).findings()
    campaign = read_campaign(file, findings)
    report(findings)
    ledger = Ledger(folder)
    wanted = {job.key: job for job in campaign.jobs}
    outcomes = {key: one for key, one in ledger.known().items() if key in wanted}
    jobs = [job for key, job in wanted.items() if key not in outcomes]
    with progress(f"campaign {campaign.name}", is_quiet=as_json) as shown:
        try:
            for outcome in perform_jobs(jobs, scheduler, workers) if jobs else ():
                ledger.keep(outcome)
                outcomes[outcome.key] = outcome
                shown(f"campaign {campaign.name}: {len(outcomes):,} of {len(wanted):,} jobs")
        except KeyboardInterrupt:
            pass  # report the results so far
    done = CampaignResult(campaign, outcomes)
    if as_json:
        print_json(document(done))
    else:
        result.print(summary(done))
    return int(done.verdict != "holds")
