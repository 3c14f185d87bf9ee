"""Report the jitter of real-time loops: percentiles, and one chart for several reports."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from fsmkit.chart.loading import read_bytes
from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.diagnostics.parsing import parse_json

PERCENTILES = (5_000, 9_900, 9_990)
"""Those that are printed, in parts of 10,000."""


@dataclass(frozen=True, slots=True)
class Latency:
    """The histogram of how late the cycles of a loop started.

    Attributes:
        name: Name of the report.
        counts: Ranges of lateness in ns (``least`` inclusive, ``below`` exclusive) with the number
            of cycles in each; ascending, without empty ranges.
        worst: Maximum lateness in ns.
        cycles: Number of all cycles, including those that the report's histogram omits.
        overruns: Cycles that ended after the next deadline, or None if not measured.
        reasons: Overruns by reason.

    """

    name: str
    counts: tuple[tuple[int, int, int], ...]
    worst: int
    cycles: int
    overruns: int | None = None
    reasons: tuple[tuple[str, int], ...] = ()

    def percentile(self, permyriad: int) -> int:
        """Return the lateness in ns that so many of 10,000 cycles did not exceed (upper bound)."""
        wanted = self.cycles * permyriad
        seen = 0
        for _, below, count in self.counts:
            seen += count
            if seen * 10_000 >= wanted:
                return min(below - 1, self.worst)
        return self.worst


def read_latency(path: Path) -> Latency:
    """Read a report: of `fsm_posix_print_json`, or of `cyclictest --json`.

    Raises:
        FsmkitError: ``unreadable-file``; ``bad-latency-report`` for other content.

    """
    text = read_bytes(path).decode(errors="replace")
    first = text.lstrip().split("\n", 1)[0]
    try:
        # A program may print more after the report, which is one line.
        document = parse_json(first if first.endswith("}") else text)
    except ValueError as error:
        raise _foreign(path, f"it is not JSON: {error}") from error
    try:
        if isinstance(document, dict) and document.get("kind") == "fsm_posix":
            return _of_loop(path.stem, document)
        if isinstance(document, dict) and "rt_test_version:" in document:
            return _of_cyclictest(path.stem, document)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise _foreign(path, f"a value is missing or wrong: {error!r}") from error
    raise _foreign(path, "it is neither")


def _foreign(path: Path, reason: str) -> FsmkitError:
    return fail(
        "bad-latency-report",
        f"`{path}` is not a report of `fsm_posix_print_json` or `cyclictest --json`: {reason}",
        help="print it anew; of cyclictest with a histogram: cyclictest -h 5000 --json=FILE",
    )


def _of_loop(name: str, document: dict[str, Any]) -> Latency:
    counts = tuple((int(low), int(high), int(n)) for low, high, n in document["jitter_ns"])
    _require_ascending(counts)
    return Latency(
        name,
        counts,
        int(document["worst_jitter_ns"]),
        sum(count for _, _, count in counts),
        int(document["overruns"]),
        tuple((str(reason), int(n)) for reason, n in document["reasons"].items() if n),
    )


def _of_cyclictest(name: str, document: dict[str, Any]) -> Latency:
    """All threads together; its histogram counts whole microseconds, up to a limit."""
    threads = document["thread"].values()
    together: dict[int, int] = {}
    for thread in threads:
        for late, count in thread["histogram"].items():
            together[int(late)] = together.get(int(late), 0) + int(count)
    counts = tuple((us * 1000, us * 1000 + 1000, n) for us, n in sorted(together.items()) if n)
    _require_ascending(counts)
    worst = max((int(thread["max"]) for thread in threads), default=0)
    return Latency(name, counts, worst * 1000, sum(int(t["cycles"]) for t in threads))


def _require_ascending(counts: Sequence[tuple[int, int, int]]) -> None:
    if any(low < 0 or high <= low or count < 0 for low, high, count in counts) or any(
        here[1] > after[0] for here, after in pairwise(counts)
    ):
        raise ValueError("ranges overlap, or are empty")


def draw_latencies(reports: Sequence[Latency], kind: str) -> bytes:
    """Draw how many cycles were later than a time: a curve a report, both axes logarithmic.

    Args:
        reports: At least one.
        kind: ``svg``, ``png`` or ``pdf``.

    Raises:
        FsmkitError: ``missing-package`` without Matplotlib.

    """
    try:
        import matplotlib as mpl
    except ImportError as error:
        raise _missing_matplotlib() from error
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    mpl.rcParams["svg.hashsalt"] = "fsmkit"
    figure, axes = plt.subplots(figsize=(8, 5), layout="constrained")
    for report in reports:
        late, share = _exceedance(report)
        figures = "  ".join(f"p{p / 100:g} {report.percentile(p) / 1000:,.1f}" for p in PERCENTILES)
        label = f"{report.name}\n{figures}  max {report.worst / 1000:,.1f} µs"
        axes.step(late, share, where="post", label=label.replace("$", r"\$"), linewidth=1.6)
    axes.set(xscale="log", yscale="log", xlabel="late by more than, µs", ylabel="share of cycles")
    axes.grid(which="both", color="#e4e7ea", linewidth=0.5)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize="small", loc="upper right")
    picture = io.BytesIO()
    figure.savefig(picture, format=kind, metadata={"Date": None} if kind == "svg" else None)
    plt.close(figure)
    return picture.getvalue()


def _exceedance(report: Latency) -> tuple[list[float], list[float]]:
    """Return times in us, and the share of cycles that were later than each."""
    left = report.cycles
    late, share = [max(report.counts[0][0] if report.counts else 1, 100) / 1000], [1.0]
    for _, below, count in report.counts:
        left -= count
        late.append(max(min(below, report.worst), 100) / 1000)
        share.append(left / report.cycles if left > 0 else math.nan)
    return late, share


def _missing_matplotlib() -> FsmkitError:
    return fail(
        "missing-package",
        "Matplotlib is not installed, so there is no picture",
        help="install it: pip install matplotlib; without `--out` the figures are printed",
    )
