"""``fsmkit campaign``: many checks on many processors."""

from __future__ import annotations

from pathlib import Path

import click

from fsmkit.cli.common.console import print_json, progress, report, result
from fsmkit.cli.common.options import Reading
from fsmkit.verify.campaign.ledger import Ledger
from fsmkit.verify.campaign.pool import performed
from fsmkit.verify.campaign.reader import read_campaign
from fsmkit.verify.campaign.show import Done, document, summary

EPILOG = """\b
Examples:
  fsmkit campaign night.yaml
  fsmkit campaign night.yaml --workers 8 --resume night
  fsmkit campaign night.yaml --scheduler tcp://10.0.0.1:8786 --json
"""


@click.command(epilog=EPILOG)
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="The scheduler of a cluster, by Dask, such as tcp://10.0.0.1:8786; without it the jobs "
    "are done on this machine.",
)
@click.option(
    "--workers",
    type=click.IntRange(min=0),
    default=0,
    show_default="one for each core",
    help="How many jobs are done at once on this machine.",
)
@click.option(
    "--resume",
    "folder",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="FOLDER",
    help="Keep what is known in this folder, and do only what is not known there yet.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def command(
    file: Path, scheduler: str | None, workers: int, folder: Path | None, as_json: bool
) -> int:
    """Do all jobs of a campaign: families of checks, mutants, searches with seeds, comparisons.

    A worker that dies loses nothing: another one does its job. Exit code 0: everything holds; 1:
    something is violated, survives, differs, is undecided or could not be done; 2: usage.
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
            for outcome in performed(jobs, scheduler, workers) if jobs else ():
                ledger.keep(outcome)
                outcomes[outcome.key] = outcome
                shown(f"campaign {campaign.name}: {len(outcomes):,} of {len(wanted):,} jobs")
        except KeyboardInterrupt:
            pass  # what is known until then is told
    done = Done(campaign, outcomes)
    if as_json:
        print_json(document(done))
    else:
        result.print(summary(done))
    return int(done.verdict != "holds")
