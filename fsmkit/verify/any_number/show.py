"""Show the result of a proof for any number of machines, as text and as data."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from fsmkit.diagnostics.as_json import as_json as finding_as_json
from fsmkit.verify.any_number.prove import Proof
from fsmkit.verify.report.counterexample import as_json
from fsmkit.verify.report.figures import quantity
from fsmkit.verify.report.show import STYLES, counterexample, diagram
from fsmkit.verify.report.verdict import Result, Verdict


def summary(proof: Proof, width: int = 0) -> RenderableType:
    """Return counterexamples, verdicts and figures for a terminal of ``width`` columns."""
    parts: list[RenderableType] = []
    for result in proof.results:
        if result.trace is not None and result.verdict is Verdict.VIOLATED:
            value = _value_of(proof, result)
            if value is not None:
                parts.append(Text(f"{proof.family.parameter}={value}", "bold"))
                drawn = diagram(proof.refuted[value], result, width)
                parts += [drawn or counterexample(result), Text()]
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    for result in proof.results:
        word = Text(result.verdict.value.upper(), STYLES[result.verdict])
        table.add_row(word, Text(result.name, "bold"), Text(f"{result.claim}: {result.reason}"))
    parts.append(table)
    parts += figures(proof)
    return Group(*parts)


def _value_of(proof: Proof, result: Result) -> int | None:
    """Return the value of the parameter for which a result has its trace."""
    for value, report in proof.refuted.items():
        if any(one.trace is result.trace for one in report.results):
            return value
    return None


def figures(proof: Proof) -> Iterator[Text]:
    """Yield the views and the explored systems."""
    name, found = proof.family.parameter, proof.abstraction
    if found is not None:
        sums = f", {quantity(found.sums, 'conserved sum')}" if found.sums else ""
        yield Text(
            f"{found.views:,} {found.method} of {found.width} cells{sums}: every {name} from "
            f"{found.least} on; computed in {found.seconds:.1f} s"
        )
    if proof.explored:
        values = [each.value for each in proof.explored]
        span = f"{values[0]}" if len(values) == 1 else f"{values[0]}..{values[-1]}"
        states = sum(each.states for each in proof.explored)
        yield Text(f"explored one by one: {name}={span}, {quantity(states, 'state')} together")


def document(proof: Proof) -> Mapping[str, object]:
    """Return verdicts, views, explored systems and findings, for JSON."""
    return {
        "verdict": proof.verdict.value,
        "parameter": proof.family.parameter,
        "least": proof.family.least,
        "properties": [_evaluated(proof, result) for result in proof.results],
        "views": None if proof.abstraction is None else asdict(proof.abstraction),
        "explored": [
            {"value": each.value, "states": each.states, "verdict": each.verdict.value}
            for each in proof.explored
        ],
        "seconds": round(proof.seconds, 3),
        "findings": [finding_as_json(finding) for finding in proof.findings],
    }


def _evaluated(proof: Proof, result: Result) -> Mapping[str, object]:
    record: dict[str, object] = {
        "name": result.name,
        "kind": result.kind.key if result.kind is not None else result.name.rpartition(".")[2],
        "verdict": result.verdict.value,
        "reason": result.reason,
    }
    if result.trace is not None:
        value = _value_of(proof, result)
        record |= {} if value is None else {"value": value}
        record["trace"] = as_json(result.trace)
        record["replayed"] = list(result.trace.replayed)
    return record
