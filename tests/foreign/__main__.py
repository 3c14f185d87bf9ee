"""`make foreign`: everything fsmkit does, with every chart of the public data.

Prints a table of commands and problems; exits with 1 if there is any problem.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

from tests.foreign.readers import READERS
from tests.foreign.trials import Trial, Tried, charts_below


def try_all(charts: Sequence[Path], root: Path, place: Path, workers: int) -> list[Tried]:
    """Try each chart in a copy of its own of the folder it lies in; let others read the files.

    In processes: of two threads, one can read the exit code of a command that the other began, and
    the other then finds none.
    """
    with ProcessPoolExecutor(workers) as pool:
        tried = list(pool.map(partial(_try, root, place), range(len(charts)), charts))
    read_by_others(tried)
    return tried


def _try(root: Path, place: Path, number: int, chart: Path) -> Tried:
    folder = place / f"{number:04}"
    shutil.copytree(chart.parent, folder / "beside", ignore=_subfolders)
    tried = Trial(folder / "beside" / chart.name, folder, str(chart.relative_to(root))).all()
    say(f"{'no' if tried.problems else 'ok':3} {tried.chart}", *tried.problems)
    return tried


def _subfolders(folder: str, names: list[str]) -> list[str]:
    """Leave out all but small files: what lies beside a chart may be a whole project."""
    paths = [Path(folder, name) for name in names]
    return [p.name for p in paths if not p.is_file() or p.stat().st_size > 2_000_000]


def read_by_others(tried: Sequence[Tried]) -> None:
    """Let the tools that are installed read all that was written; what they refuse is a problem."""
    by_suffix = defaultdict(list)
    owner = {}
    for one in tried:
        for path in one.written:
            by_suffix[path.suffix.lstrip(".")].append(path)
            owner[path] = one
    for suffix, files in by_suffix.items():
        reader = READERS.get(suffix)
        if reader is None or not reader.is_there():
            continue
        for path, words in reader.read(files).items():
            owner[path].problems.append(f"refused by {reader.name}: {path.name}: {words}")


def say(*lines: str) -> None:
    """Print lines at once: a run lasts long."""
    sys.stdout.write("\n      ".join(lines) + "\n")
    sys.stdout.flush()


def summary(tried: Sequence[Tried]) -> str:
    """Return the totals as lines."""
    kinds = Counter(p.split(":", 1)[0] for one in tried for p in one.problems)
    files = Counter(path.suffix for one in tried for path in one.written)
    missing = sorted({r.name for r in READERS.values() if not r.is_there()})
    return "\n".join(
        (
            f"{len(tried)} files, {sum(t.is_chart for t in tried)} charts",
            f"commands: {sum(t.commands for t in tried):,}",
            f"written: {', '.join(f'{n:,} {s}' for s, n in sorted(files.items()))}",
            f"not installed: {', '.join(missing) or 'nothing'}",
            f"problems: {', '.join(f'{n} {k}' for k, n in kinds.most_common()) or 'none'}",
        )
    )


def main() -> int:
    """Try the charts below the folders."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--every", type=int, default=1, help="each n-th chart")
    options = parser.parse_args()
    tried = []
    for folder in options.folders:
        charts = list(charts_below(folder))[:: options.every]
        with tempfile.TemporaryDirectory(prefix="fsmkit-foreign-") as place:
            tried += try_all(charts, folder, Path(place), options.workers)
    for one in tried:
        for problem in one.problems:
            say(f"{one.chart}: {problem}")
    say(summary(tried))
    return int(any(one.problems for one in tried))


if __name__ == "__main__":
    sys.exit(main())
