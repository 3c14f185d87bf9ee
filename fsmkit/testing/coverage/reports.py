"""Coverage as figures, and as files of other tools: LCOV and Cobertura, by the lines of charts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from lxml import etree

from fsmkit.testing.coverage.decisions import covered_conditions
from fsmkit.testing.coverage.record import ChartCoverage, Decision, Item


@dataclass(frozen=True, slots=True)
class Figure:
    """So many of so many."""

    covered: int
    all: int

    @property
    def percent(self) -> float:
        """The share; all, where there is nothing to cover."""
        return 100.0 if not self.all else 100.0 * self.covered / self.all

    def __add__(self, other: Figure) -> Figure:
        return Figure(self.covered + other.covered, self.all + other.all)


@dataclass(frozen=True, slots=True)
class Figures:
    """The four kinds of things that can be covered."""

    states: Figure
    transitions: Figure
    decisions: Figure
    """Outcomes, true and false, of guards."""
    conditions: Figure
    """Conditions of guards that were shown to decide (MC/DC)."""

    @property
    def whole(self) -> Figure:
        """All of them."""
        return self.states + self.transitions + self.decisions + self.conditions

    def __add__(self, other: Figures) -> Figures:
        return Figures(
            self.states + other.states,
            self.transitions + other.transitions,
            self.decisions + other.decisions,
            self.conditions + other.conditions,
        )


def figures(chart: ChartCoverage) -> Figures:
    """Return the coverage figures of a chart."""
    shown = [shown_conditions(decision) for decision in chart.decisions]
    return Figures(
        _figure(chart.states),
        _figure(chart.transitions),
        Figure(sum((d.true > 0) + (d.false > 0) for d in chart.decisions), 2 * len(shown)),
        Figure(sum(map(sum, shown)), sum(map(len, shown))),
    )


def total(charts: Iterable[ChartCoverage]) -> Figures:
    """Add the figures of charts."""
    nothing = Figure(0, 0)
    return sum(map(figures, charts), Figures(nothing, nothing, nothing, nothing))


def shown_conditions(decision: Decision) -> tuple[bool, ...]:
    """Return for each condition of a guard whether it was shown to decide."""
    seen = [outcomes for outcomes, _ in decision.seen]
    return covered_conditions(decision.shape, len(decision.conditions), seen)


def _figure(items: Sequence[Item]) -> Figure:
    return Figure(sum(item.count > 0 for item in items), len(items))


def missing(chart: ChartCoverage) -> Iterator[tuple[str, str]]:
    """Yield the location and description of each uncovered item."""
    for kind, items in (("state", chart.states), ("transition", chart.transitions)):
        for item in items:
            if not item.count:
                yield _at(item), f"{kind} {item.text}"
    for decision in chart.decisions:
        place = _at(decision)
        if not (decision.true or decision.false):
            yield place, f"guard never evaluated: {decision.text}"
            continue
        for count, value in ((decision.true, "true"), (decision.false, "false")):
            if not count:
                yield place, f"guard never {value}: {decision.text}"
        for condition, shown in zip(decision.conditions, shown_conditions(decision), strict=True):
            if not shown and len(decision.conditions) > 1:
                yield place, f"condition never shown to decide: {condition} in {decision.text}"


def covered(chart: ChartCoverage) -> Iterator[str]:
    """Yield the covered items with their locations."""
    for kind, items in (("state", chart.states), ("transition", chart.transitions)):
        yield from (f"{_at(item)}: {kind} {item.text}" for item in items if item.count)
    for decision in chart.decisions:
        for count, value in ((decision.true, "true"), (decision.false, "false")):
            if count:
                yield f"{_at(decision)}: guard {value}: {decision.text}"
        for condition, shown in zip(decision.conditions, shown_conditions(decision), strict=True):
            if shown and len(decision.conditions) > 1:
                yield f"{_at(decision)}: condition {condition} in {decision.text}"


def _at(item: Item | Decision) -> str:
    return f"{item.at.file}:{item.at.line}"


# --- lines ----------------------------------------------------------------------------------------


@dataclass(slots=True)
class Line:
    """A line of a chart: how often something on it happened, and its branches."""

    hits: int = 0
    branches: list[int] = field(default_factory=list)


def lines(charts: Iterable[ChartCoverage]) -> dict[str, dict[int, Line]]:
    """Return the lines of each file on which something can be covered, over all charts.

    A guard has two branches. Where a line has several states and transitions each is a branch.
    """
    items: dict[tuple[str, int], dict[str, int]] = {}
    guards: dict[tuple[str, int], dict[str, tuple[int, int]]] = {}
    for chart in charts:
        for item in (*chart.states, *chart.transitions):
            at = items.setdefault((item.at.file, item.at.line), {})
            at[item.text] = at.get(item.text, 0) + item.count
        for decision in chart.decisions:
            sides = guards.setdefault((decision.at.file, decision.at.line), {})
            true, false = sides.get(decision.text, (0, 0))
            sides[decision.text] = true + decision.true, false + decision.false
    found: dict[str, dict[int, Line]] = {}
    for (file, number), counts in sorted(items.items()):
        line = found.setdefault(file, {}).setdefault(number, Line())
        line.hits = sum(counts.values())
        if len(counts) > 1:
            line.branches += counts.values()
        for pair in guards.get((file, number), {}).values():
            line.branches += pair
    return found


def lcov(charts: Sequence[ChartCoverage]) -> str:
    """Return a tracefile as `geninfo` describes it, which `genhtml` reads."""
    parts = []
    for file, numbered in lines(charts).items():
        parts += ["TN:", f"SF:{' '.join(file.splitlines())}"]
        for number, line in numbered.items():
            parts += [
                f"BRDA:{number},0,{branch},{taken if line.hits else '-'}"
                for branch, taken in enumerate(line.branches)
            ]
        branches = [taken for line in numbered.values() for taken in line.branches]
        parts += [f"BRF:{len(branches)}", f"BRH:{sum(map(bool, branches))}"]
        parts += [f"DA:{number},{line.hits}" for number, line in numbered.items()]
        parts += [f"LF:{len(numbered)}", f"LH:{sum(bool(each.hits) for each in numbered.values())}"]
        parts.append("end_of_record")
    return "".join(f"{part}\n" for part in parts)


def cobertura(charts: Sequence[ChartCoverage], version: str, timestamp: int) -> str:
    """Return a report as ``coverage-04.dtd`` of Cobertura has it; ``timestamp`` in milliseconds."""
    by_file = lines(charts)
    every = [line for numbered in by_file.values() for line in numbered.values()]
    root = etree.Element("coverage", _rates(every), version=f"fsmkit {version}", complexity="0")
    root.set("timestamp", str(timestamp))
    etree.SubElement(etree.SubElement(root, "sources"), "source").text = "."
    package = etree.SubElement(
        etree.SubElement(root, "packages"), "package", _rates(every, counts=False), name="charts"
    )
    package.set("complexity", "0")
    classes = etree.SubElement(package, "classes")
    for file, numbered in by_file.items():
        rates = _rates(list(numbered.values()), counts=False)
        name = _legal(file)
        one = etree.SubElement(classes, "class", rates, name=name, filename=name, complexity="0")
        etree.SubElement(one, "methods")
        inside = etree.SubElement(one, "lines")
        for number, line in numbered.items():
            element = etree.SubElement(inside, "line", number=str(number), hits=str(line.hits))
            element.set("branch", "true" if line.branches else "false")
            if line.branches:
                taken = sum(map(bool, line.branches))
                share = 100 * taken // len(line.branches)
                element.set("condition-coverage", f"{share}% ({taken}/{len(line.branches)})")
    doctype = '<!DOCTYPE coverage SYSTEM "http://cobertura.sourceforge.net/xml/coverage-04.dtd">'
    text: bytes = etree.tostring(
        root, xml_declaration=True, encoding="UTF-8", pretty_print=True, doctype=doctype
    )
    return text.decode()


def _rates(every: Sequence[Line], *, counts: bool = True) -> dict[str, str]:
    branches = [taken for line in every for taken in line.branches]
    covered, taken = sum(bool(line.hits) for line in every), sum(map(bool, branches))
    rates = {
        "line-rate": f"{covered / len(every) if every else 1:.4f}",
        "branch-rate": f"{taken / len(branches) if branches else 1:.4f}",
    }
    if counts:
        rates |= {
            "lines-covered": str(covered), "lines-valid": str(len(every)),
            "branches-covered": str(taken), "branches-valid": str(len(branches)),
        }  # fmt: skip
    return rates


def _legal(text: str) -> str:
    """Return a text without the characters that XML 1.0 cannot hold."""
    return "".join(
        c if c in "\t\n\r" or (c >= " " and c not in "\ufffe\uffff") else "\ufffd" for c in text
    )
