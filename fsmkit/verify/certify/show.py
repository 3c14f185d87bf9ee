"""A certificate as text for people."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fsmkit.emit import telling

MOST_ROWS = 12
"""The kinds of steps that the summary lists, those with the most instructions."""
RESULTS = {
    "complete": "every reachable step is equal in all executions",
    "partial": "equal as far as it was explored",
    "different": "the executions differ",
}


@telling
def summary(document: Mapping[str, Any]) -> str:
    """Return a certificate in short."""
    lines = [
        (
            f"{document['chart']} for {document['target']}: {document['result']}, "
            f"{RESULTS[document['result']]}"
        ),
        f"  compiler  {document['compiler']}",
        (
            f"  steps     {document['steps']:,} in {document['states']:,} states, "
            f"{document['interpreted']:,} interpreted, {document['repeated']:,} repeated"
        ),
        f"  covered   {covered(document)}",
        *(f"  partial   {reason}" for reason in document["reasons"]),
    ]
    rows = sorted(document["maxima"], key=lambda row: -int(row["instructions"]))
    if rows:
        has_cycles = rows[0]["cycles"] is not None
        width = max(len(row["step"]) for row in rows[:MOST_ROWS])
        head = f"  {'worst case of':<{width}}  instructions"
        lines += ["", f"{head}{'  cycles' if has_cycles else ''}  stack bytes"]
        for row in rows[:MOST_ROWS]:
            cycles = f"  {row['cycles']:>6,}" if has_cycles else ""
            count = f"{row['instructions']:>12,}{cycles}  {row['stack']:>11,}"
            lines.append(f"  {row['step']:<{width}}  {count}")
        if len(rows) > MOST_ROWS:
            lines.append(f"  and {len(rows) - MOST_ROWS} more kinds of steps in the certificate")
    return "\n".join(lines)


def covered(document: Mapping[str, Any]) -> str:
    """Return the coverage in words."""
    return ", ".join(
        f"{found['covered']} of {found['all']} {name}"
        for name, found in document["coverage"].items()
    ).replace("pairs", "pairs of state and event")
