"""``python -m devtools.endurance CHART... --hours 24``: the long run, and its table."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import click
from rich.console import Console
from rich.table import Table

from devtools.endurance.program import report_limits
from devtools.endurance.run import Account, endure
from fsmkit.chart.loading import load
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.document.document import Trigger

BEGIN, END = "<!-- make endurance -->", "<!-- end -->"
ROWS: tuple[tuple[str, str], ...] = (
    ("sessions", "sessions, each from a start"),
    ("restarts", "starts in between"),
    ("calls", "calls of run"),
    ("jumps", "jumps of the clock, 5 s to 60 s"),
    ("wraps", "wrap-arounds of the clock"),
    ("transitions", "transitions taken"),
    ("states_seen", "states entered, different ones"),
    ("states", "  of"),
    ("transitions_seen", "transitions taken, different ones"),
    ("different", "  of"),
    ("operations", "operations called"),
    ("", "events"),
    ("offered", "offered"),
    ("posted", "  posted"),
    ("posted_within", "  posted within a step"),
    ("put", "  put into the mailbox by a second context"),
    ("dispatched", "  dispatched"),
    ("dispatched_within", "  dispatched within a step"),
    ("sent", "  sent by the machine to itself"),
    ("taken", "= taken"),
    ("unhandled", "+ unhandled"),
    ("full", "+ rejected: queue full"),
    ("lost", "+ rejected: mailbox full"),
    ("busy", "+ rejected: within a step"),
    ("stopped", "+ rejected: stopped"),
    ("faulted", "+ current in a fault"),
    ("left", "+ waiting at a start or an end"),
    ("still", "+ waiting still"),
    ("deferrals", "deferred on the way"),
    ("held", "held back in the mailbox, the queue being full"),
    ("faults", "faults of the machine"),
    ("", "timers"),
    ("armed", "armed"),
    ("fired", "= fired"),
    ("cancelled", "+ cancelled"),
    ("timers_left", "+ armed at a start"),
    ("pending", "+ pending"),
    ("jumped_over", "fired in one call after another"),
    ("", "compared"),
    ("checks", "checks of the account"),
    ("replayed", "sessions alike in the interpreter"),
    ("lines", "lines of traces alike in all runtimes"),
)


@click.command()
@click.argument("charts", nargs=-1, required=True, type=click.Path(exists=True, path_type=Path))
@click.option("--hours", default=24.0, show_default=True, help="Of simulated time, each chart.")
@click.option("--seed", default=1, show_default=True)
@click.option("--samples", default=20, show_default=True, help="Sessions done again, at most.")
@click.option("--compared", default=4, show_default=True, help="Of these, by all runtimes.")
@click.option("--write", type=click.Path(path_type=Path), help="Put the table into this page.")
@click.option("--keep", type=click.Path(path_type=Path), help="Leave programs and scripts here.")
def main(
    charts: Sequence[Path],
    hours: float,
    seed: int,
    samples: int,
    compared: int,
    write: Path | None,
    keep: Path | None,
) -> None:
    """Run charts under random events and faults, and account for each event and timer."""
    console = Console(highlight=False, width=None if sys.stdout.isatty() else 160)
    started = time.monotonic()
    accounts = []
    try:
        with TemporaryDirectory(prefix="fsmkit-") as folder, console.status("") as status:
            for path in charts:
                chart = load(path)
                findings = Findings()
                report_limits(chart, findings)
                if findings.has_errors:
                    reasons = "; ".join(dict.fromkeys(f.message for f in findings))
                    console.print(f"{chart.name} is skipped: {reasons}", markup=False)
                    continue
                account = endure(
                    chart,
                    (keep or Path(folder)) / path.stem,
                    seconds=round(hours * 3600),
                    seed=seed,
                    samples=samples,
                    compared=compared,
                    report=status.update,
                )
                accounts.append(account)
    except FsmkitError as error:
        console.print(str(error), markup=False)
        sys.exit(1)
    title = f"{hours:g} simulated hours of each, seed {seed}"
    console.print(table(accounts, title))
    if write is not None:
        page = write.read_text(encoding="utf-8")
        write.write_text(placed(page, markdown(accounts, title)), encoding="utf-8")
    for account in accounts:
        if not account.is_sanitized:
            console.print(f"{account.chart.name}: without sanitizers, the compiler has none")
    console.print(f"no law broken; {time.monotonic() - started:.0f} s")


def table(accounts: Sequence[Account], title: str) -> Table:
    """Return the table of several charts."""
    found = Table(title=title, title_justify="left", box=None, pad_edge=False)
    found.add_column("")
    for account in accounts:
        found.add_column(account.chart.name, justify="right")
    for name, meaning in ROWS:
        if not name:
            found.add_row("")
            found.add_row(f"[bold]{meaning}[/]")
            continue
        value = VALUES.get(name, lambda account, name=name: account.figures[name])
        found.add_row(meaning, *(f"{value(account):,}" for account in accounts))
    return found


def markdown(accounts: Sequence[Account], title: str) -> str:
    """Return the same table in Markdown."""
    names = [account.chart.name for account in accounts]
    lines = [f"{title}.", "", f"| | {' | '.join(names)} |", f"|---|{'---:|' * len(names)}"]
    for name, meaning in ROWS:
        if not name:
            lines.append(f"| **{meaning}** |{' |' * len(names)}")
            continue
        value = VALUES.get(name, lambda account, name=name: account.figures[name])
        shown = " | ".join(f"{value(account):,}" for account in accounts)
        lines.append(f"| {meaning.strip()} | {shown} |")
    return "\n".join(lines) + "\n"


def placed(page: str, text: str) -> str:
    """Return a page with a text between its marks, of which it has one pair."""
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        raise click.UsageError(f"the page has no place for the table: {BEGIN} and {END}")
    return f"{before}{begin}\n{text}{end}{after}"


VALUES: dict[str, Callable[[Account], int]] = {
    "states": lambda a: sum(not s.is_history for s in a.chart.states[1:]),
    "different": lambda a: sum(
        t.trigger is not Trigger.SOMETIMES and (t.trigger is not Trigger.INITIAL or bool(t.content))
        for t in a.chart.transitions
    ),
    "still": lambda a: sum(a.figures[name] for name in ("waiting", "deferred", "in_mailbox")),
    "replayed": lambda a: a.replayed,
    "lines": lambda a: a.lines,
}

if __name__ == "__main__":
    main()
