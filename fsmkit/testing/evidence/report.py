"""The report: one page with all evidence of a system, and the index by standards."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fsmkit.emit import html
from fsmkit.emit.html import Markup, element, join, listing, table
from fsmkit.testing.coverage.record import ChartCoverage
from fsmkit.testing.coverage.reports import Figure, figures, missing, total
from fsmkit.testing.evidence.eva import Proof
from fsmkit.testing.evidence.misra import Lint
from fsmkit.testing.evidence.standards import (
    ANALYSES,
    CERTIFICATES,
    CHECK,
    IEC,
    ISO,
    MODEL,
    MUTANTS,
    REQUIREMENTS,
    TESTS,
    Technique,
)
from fsmkit.testing.requirements import writing
from fsmkit.testing.requirements.matrix import CaseResult, Matrix, Status


@dataclass(frozen=True, slots=True)
class MachineEvidence:
    """The evidence for the chart of a machine.

    ``reason``: why there is no certificate. ``proof`` and ``lint`` are None without the tool.
    """

    name: str
    file: str
    certificate: Mapping[str, Any] | None
    reason: str
    proof: Proof | None
    lint: Lint | None
    drawing: bytes = b""


@dataclass(frozen=True, slots=True)
class Evidence:
    """All parts of a report.

    ``checked`` and ``mutants`` are the documents of `fsmkit check` and `fsmkit mutants`;
    ``mutants`` is None if none were requested.
    """

    title: str
    version: str
    model: str
    sources: tuple[tuple[str, str], ...]
    """Each file and its SHA-256."""
    checked: Mapping[str, Any]
    mutants: Mapping[str, Any] | None
    cases: tuple[CaseResult, ...]
    coverage: tuple[ChartCoverage, ...]
    machines: tuple[MachineEvidence, ...]
    matrix: Matrix | None

    def parts(self) -> frozenset[str]:
        """Return the ids of the parts that have content."""
        given = {
            MODEL: True,
            CHECK: True,
            MUTANTS: self.mutants is not None and bool(self.mutants["mutants"]),
            TESTS: bool(self.cases),
            CERTIFICATES: any(one.certificate is not None for one in self.machines),
            ANALYSES: any(
                found is not None and not found.failure
                for one in self.machines
                for found in (one.proof, one.lint)
            ),
            REQUIREMENTS: self.matrix is not None,
        }
        return frozenset(part for part, is_given in given.items() if is_given)

    def failures(self) -> tuple[str, ...]:
        """Return what the evidence shows to be wrong or undecided, in words."""
        found = []
        if self.checked["verdict"] != "holds":
            found.append(f"the check: {self.checked['verdict']}")
        found += [f"the test `{one.name}` failed" for one in self.cases if not one.passed]
        for one in self.machines:
            if one.certificate is not None and one.certificate["result"] == "different":
                found.append(f"the executions of `{one.name}` differ")
            if one.proof is not None and one.proof.alarms:
                found.append(f"EVA reports {len(one.proof.alarms)} alarms in `{one.name}`")
        if self.matrix is not None:
            counts = writing.counts(self.matrix)
            found += [
                f"{counts[status.value]} requirements are {status.value}"
                for status in (Status.FAILED, Status.UNDECIDED, Status.OPEN)
                if counts[status.value]
            ]
        return tuple(found)


def page(evidence: Evidence) -> str:
    """Return the report as one page of HTML that loads nothing."""
    return html.page(
        f"Evidence for {evidence.title}",
        element("h1", f"Evidence for {evidence.title}"),
        element("p", f"{evidence.model}, fsmkit {evidence.version}", class_="soft"),
        element("p", CLAIM, class_="note"),
        _cards(evidence),
        _contents(evidence),
        *_failures(evidence),
        *_model(evidence),
        *_requirements(evidence),
        *_checked(evidence),
        *_mutants(evidence),
        *_tests(evidence),
        *_certificates(evidence),
        *_analyses(evidence),
        *_index("iec", "Index by the tables of IEC 61508-3:2010, Annexes A and B", IEC, evidence),
        *_index("iso", "Index by the tables of ISO 26262-6:2018", ISO, evidence),
        *_limits(),
        style="h2 { scroll-margin-top: 1rem; } .contents { columns: 2; max-width: 40rem; }",
    )


TITLES = {
    MODEL: "Model and sources",
    REQUIREMENTS: "Requirements",
    CHECK: "Exhaustive check",
    MUTANTS: "Seeded mistakes",
    TESTS: "Tests and structural coverage",
    CERTIFICATES: "Certificates of the code",
    ANALYSES: "Static analyses of the generated C",
    "iec": "IEC 61508-3",
    "iso": "ISO 26262-6",
    "limits": "Limits of this report",
}


def _title(part: str, title: str = "") -> Markup:
    return element("h2", title or TITLES[part], id=part)


def _contents(evidence: Evidence) -> Markup:
    del evidence
    links = (element("a", title, href=f"#{part}") for part, title in TITLES.items())
    return listing(links, "plain contents")


def _card(figure: str, label: str, class_: str = "") -> Markup:
    bold = element("b", figure, class_=class_)
    return element("div", bold, element("span", label), class_="card")


def _cards(evidence: Evidence) -> Markup:
    checked = evidence.checked
    results = checked["properties"]
    held = sum(one["verdict"] == "holds" for one in results)
    found = [
        _card(f"{held} of {len(results)}", "properties hold", _good(held == len(results))),
        _card(_number(checked["states"]), "states explored"),
    ]
    if evidence.matrix is not None:
        verified = writing.counts(evidence.matrix)[Status.VERIFIED.value]
        rows = len(evidence.matrix.rows)
        found.append(
            _card(f"{verified} of {rows}", "requirements verified", _good(verified == rows))
        )
    if evidence.mutants is not None and evidence.mutants["mutants"]:
        fates = [one["fate"] for one in evidence.mutants["mutants"]]
        detected = sum(fate == "found" for fate in fates)
        found.append(_card(f"{detected} of {len(fates)}", "seeded mistakes found"))
    if evidence.cases:
        passed, cases = sum(one.passed for one in evidence.cases), len(evidence.cases)
        found.append(_card(f"{passed} of {cases}", "tests passed", _good(passed == cases)))
    certified = [one.certificate for one in evidence.machines if one.certificate is not None]
    complete = sum(one["result"] == "complete" for one in certified)
    machines = len(evidence.machines)
    found.append(
        _card(f"{complete} of {machines}", "machines certified", _good(complete == machines))
    )
    return element("div", *found, class_="cards")


def _good(is_good: bool) -> str:
    return "good" if is_good else "open"


def _number(value: object) -> str:
    return f"{value:,}" if isinstance(value, int) else str(value)


def _failures(evidence: Evidence) -> Iterator[Markup]:
    failures = evidence.failures()
    if failures:
        yield element("h3", "Failed or undecided", class_="bad")
        yield listing(failures)


def _model(evidence: Evidence) -> Iterator[Markup]:
    yield _title(MODEL)
    yield element(
        "p", "The charts below are the model that was checked. The generated C, which the check "
        "executes, was made from these files.",
    )  # fmt: skip
    rows = ((element("code", file), element("code", digest)) for file, digest in evidence.sources)
    yield table(("file", "SHA-256"), rows)
    for one in evidence.machines:
        if one.drawing:
            source = f"data:image/svg+xml;base64,{b64encode(one.drawing).decode()}"
            yield element(
                "details",
                element("summary", f"Drawing of {one.name}"),
                element("img", alt=f"The states of {one.name}", src=source),
            )


def _requirements(evidence: Evidence) -> Iterator[Markup]:
    yield _title(REQUIREMENTS)
    if evidence.matrix is None:
        yield _absent("No file of requirements was named (option --requirements).")
        return
    yield writing.table(evidence.matrix)
    yield from writing.rest(evidence.matrix)


def _absent(text: str) -> Markup:
    return element("p", text, class_="soft")


def _checked(evidence: Evidence) -> Iterator[Markup]:
    checked = evidence.checked
    yield _title(CHECK)
    how = "all states were explored" if checked["complete"] else "not all states were explored"
    yield element(
        "p", f"{_number(checked['states'])} states and {_number(checked['transitions'])} "
        f"transitions; {how} in {checked['seconds']:g} s. Engine: {checked['engine']}; "
        f"time: {checked['time']}.",
    )  # fmt: skip
    rows = (
        (element("code", one["name"]), one["kind"], writing.verdict_mark(one["verdict"]),
         one.get("reason", ""))
        for one in checked["properties"]
    )  # fmt: skip
    yield table(("property", "kind", "verdict", "reason"), rows)
    if checked["assumptions"]:
        yield element("h3", "Assumptions")
        yield listing(checked["assumptions"])
    bounds = (
        (name, str(found["queue"]), str(found["timers"]), str(found["microsteps"]))
        for name, found in checked["bounds"].items()
    )
    yield element("h3", "Proved bounds")
    yield table(("machine", "queued events", "timers", "microsteps"), bounds, "figures")


def _mutants(evidence: Evidence) -> Iterator[Markup]:
    yield _title(MUTANTS)
    mutants = evidence.mutants
    if mutants is None or not mutants["mutants"]:
        yield _absent("No mistakes were seeded.")
        return
    fates = [one["fate"] for one in mutants["mutants"]]
    yield element(
        "p", f"A sample of {len(fates)} of {_number(mutants['possible'])} possible changes was "
        "seeded into charts and connections, one at a time. A mistake is found if a property or a "
        "built-in check fails.",
    )  # fmt: skip
    counts = ((fate, str(fates.count(fate))) for fate in dict.fromkeys(fates))
    yield table(("fate", "mistakes"), counts, "figures")
    rows = (
        (one["machine"], one["what"], element("code", one["place"] or ""),
         writing.mark(one["fate"], FATES.get(one["fate"], "open")), ", ".join(one["by"]))
        for one in mutants["mutants"]
    )  # fmt: skip
    whole = table(("machine", "mistake", "location", "fate", "found by"), rows)
    yield element("details", element("summary", "All seeded mistakes"), whole)


FATES = {"found": "good", "surviving": "bad"}


def _tests(evidence: Evidence) -> Iterator[Markup]:
    yield _title(TESTS)
    if not evidence.cases:
        yield _absent("No test file was named (option --tests).")
        return
    rows = (
        (one.name, element("code", writing.place(one.span)),
         writing.mark("passed", "good") if one.passed else writing.mark("failed", "bad"))
        for one in evidence.cases
    )  # fmt: skip
    yield table(("case", "location", "result"), rows)
    yield element("h3", "Coverage of the charts")
    yield element(
        "p", "States entered, transitions taken, outcomes of guards, and conditions of guards "
        "that were shown to decide (masking MC/DC).",
    )  # fmt: skip
    covered = [(chart.name, figures(chart)) for chart in evidence.coverage]
    covered.append(("all", total(evidence.coverage)))
    cells = (
        (name, *map(_ratio, (one.states, one.transitions, one.decisions, one.conditions)))
        for name, one in covered
    )
    heads = ("chart", "states", "transitions", "decisions", "conditions (MC/DC)")
    yield table(heads, cells, "figures")
    for chart in evidence.coverage:
        left = [join([element("code", at), f" {what}"]) for at, what in missing(chart)]
        if left:
            title = element("summary", f"{chart.name}: {len(left)} not covered")
            yield element("details", title, listing(left))


def _ratio(figure: Figure) -> str:
    return f"{figure.covered} of {figure.all}"


def _certificates(evidence: Evidence) -> Iterator[Markup]:
    yield _title(CERTIFICATES)
    yield element(
        "p", "A complete certificate: each reachable step of the chart was executed in the "
        "reference interpreter, in the C on this computer and, for another target, in its binary; "
        "all results were equal.",
    )  # fmt: skip
    rows = []
    for one in evidence.machines:
        found = one.certificate
        if found is None:
            rows.append((one.name, writing.mark("none", "open"), one.reason, "", ""))
            continue
        style = {"complete": "good", "partial": "open"}.get(found["result"], "bad")
        rows.append((
            one.name, writing.mark(found["result"], style),
            f"{found['target']}, {found['compiler']}",
            _number(found["states"]), _number(found["steps"]),
        ))  # fmt: skip
    yield table(("machine", "certificate", "target and compiler", "states", "steps"), rows)
    for one in evidence.machines:
        yield from _maxima(one)


def _maxima(one: MachineEvidence) -> Iterator[Markup]:
    if one.certificate is None:
        return
    found = [
        each for each in one.certificate.get("maxima", ()) if each.get("instructions") is not None
    ]
    if not found:
        return
    rows = (
        (each["step"], _number(each["instructions"]), _number(each.get("stack", "")))
        for each in found
    )
    heads = ("step", "most instructions", "most bytes of stack")
    title = element("summary", f"{one.name}: the longest path of each event")
    yield element("details", title, table(heads, rows, "figures"))


def _analyses(evidence: Evidence) -> Iterator[Markup]:
    yield _title(ANALYSES)
    rows = [(one.name, _proof(one.proof), _lint(one.lint)) for one in evidence.machines]
    yield table(("machine", "run-time errors (Frama-C/EVA)", "MISRA C:2012 (Cppcheck)"), rows)
    yield element(
        "p", "EVA analyses the machine under a host that does anything its contract allows. The "
        "reasons for the deviations from MISRA C:2012 are in the reference of fsmkit, under "
        "Analyses.", class_="soft",
    )  # fmt: skip


def _proof(proof: Proof | None) -> Markup:
    if proof is None:
        return element("span", "Frama-C is not installed", class_="soft")
    if proof.failure:
        return join([writing.mark("undecided", "open"), " ", proof.failure])
    if proof.alarms:
        return join([writing.mark(f"{len(proof.alarms)} alarms", "bad"), listing(proof.alarms)])
    reached = f" {proof.reached} % of the statements reached"
    return join([writing.mark("no alarm", "good"), reached])


def _lint(lint: Lint | None) -> Markup:
    if lint is None:
        return element("span", "Cppcheck is not installed", class_="soft")
    if lint.failure:
        return join([writing.mark("undecided", "open"), " ", lint.failure])
    deviations = ", ".join(f"{rule} ({count})" for rule, count in lint.deviations.items())
    style = "bad" if lint.warnings else "good"
    warnings = writing.mark(f"{len(lint.warnings)} warnings", style)
    return join([warnings, element("div", f"deviations: {deviations or 'none'}", class_="soft")])


def _index(
    part: str, title: str, techniques: Sequence[Technique], evidence: Evidence
) -> Iterator[Markup]:
    yield _title(part, title)
    yield element(
        "p", "Rows that this report can support. How strongly a row is recommended depends on the "
        "integrity level; whether its support suffices, an assessor decides.",
    )  # fmt: skip
    given = evidence.parts()
    rows = (
        (
            one.table,
            one.row,
            one.name,
            element("a", TITLES[one.part], href=f"#{one.part}")
            if one.part in given
            else element("span", "not in this report", class_="soft"),
            one.how,
        )
        for one in techniques
    )
    yield table(("table", "row", "technique", "part", "contribution"), rows)


def _limits() -> Iterator[Markup]:
    yield _title("limits")
    yield listing(LIMITS, "limits")


CLAIM = (
    "This report collects evidence. It is not a certification. A person decides whether the "
    "properties say what the requirements say, and whether the assumptions hold on the device."
)
SHARED = (
    "fsmkit is not a qualified tool. All parts share its reader of charts. The interpreter, "
    "the generated C and the analyses are different programs."
)
OUTSIDE = (
    "The properties are as good as their wording. The code of operations, the drivers, the "
    "compiler and the hardware are outside, unless a certificate names the target."
)
SAMPLED = "The seeded mistakes are a sample, and MC/DC is that of the charts, not of object code."
LIMITS = (SHARED, OUTSIDE, SAMPLED)
