"""``fsmkit conformance``: public test suites, a line each and a total."""

from __future__ import annotations

from pathlib import Path

import click
from rich.progress import Progress
from rich.text import Text

from fsmkit.cli.console import err, out, print_json
from fsmkit.testing.conformance import Result, Verdict, judge
from fsmkit.testing.conformance_suites import find_cases
from fsmkit.testing.harness import harness, harnesses

STYLES = {Result.PASSED: "green", Result.FAILED: "bold red", Result.SKIPPED: "yellow"}
EPILOG = """\b
Example:
  fsmkit conformance ../shared/conformance/w3c --target all
"""


@click.command(epilog=EPILOG)
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
@click.option("--target", default="interpreter", show_default=True, help="A target, or `all`.")
@click.option("--limit", type=float, default=60.0, show_default=True, help="Seconds for a test.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
@click.option("--quiet", is_flag=True, help="Print no line for a test that passed.")
def command(folder: Path, target: str, limit: float, as_json: bool, quiet: bool) -> int:
    """Run the W3C's SCXML tests, or charts with a script each, and count."""
    chosen = harnesses() if target == "all" else (harness(target),)
    cases = find_cases(folder)
    verdicts: list[Verdict] = []
    with Progress(console=err, transient=True, disable=not err.is_terminal) as progress:
        for case in progress.track(cases, description="conformance"):
            for verdict in judge(case, chosen, limit):
                verdicts.append(verdict)
                if not as_json and not (quiet and verdict.result is Result.PASSED):
                    out.print(line(verdict))
    if as_json:
        print_json(document(verdicts))
    else:
        for one in chosen:
            counted = count([v for v in verdicts if v.target == one.name])
            out.print(f"{one.name}: {', '.join(f'{n} {name}' for name, n in counted.items())}")
    return int(any(verdict.result is Result.FAILED for verdict in verdicts))


def line(verdict: Verdict) -> Text:
    """Return the line of one test on one runtime."""
    text = Text(f"{verdict.result.value:8}", STYLES[verdict.result])
    text.append(f"{verdict.target:12}{verdict.name}", "")
    text.append(f"  {verdict.reason}" if verdict.reason else "", "dim")
    return text


def count(verdicts: list[Verdict]) -> dict[str, int]:
    """Return how many tests ended in which way."""
    return {result.value: sum(v.result is result for v in verdicts) for result in Result}


def document(verdicts: list[Verdict]) -> dict[str, object]:
    """Return the verdicts as data for JSON."""
    tests = [
        {
            "name": verdict.name,
            "target": verdict.target,
            "result": verdict.result.value,
            **({"reason": verdict.reason} if verdict.reason else {}),
        }
        for verdict in verdicts
    ]
    return {**count(verdicts), "tests": tests}
