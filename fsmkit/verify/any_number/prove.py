"""Decide the properties of a system for every number of machines.

Windows of growing width prove properties for all rings from a length on; smaller systems are
explored one by one. A property is only refuted by a system that was explored. When neither
succeeds, it is undecided, and the report names the largest system that was explored.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from fsmkit.diagnostics import Findings, FsmkitError, Severity, fail
from fsmkit.system.system import System
from fsmkit.verify.any_number.cells import Numbers, Ring
from fsmkit.verify.any_number.claims import Claim, Form, Instances, read_claims
from fsmkit.verify.any_number.conserved import Weights
from fsmkit.verify.any_number.family import MOST_ENDS, RULE, Family, read_family
from fsmkit.verify.any_number.multisets import Multisets
from fsmkit.verify.any_number.sums import candidates, not_conserved
from fsmkit.verify.any_number.windows import TooManyViewsError, Windows
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.report.verdict import Report, Result, Verdict, add_finding
from fsmkit.verify.resources.deadline import Deadline, Stage, TimeUp
from fsmkit.verify.statespace.closed_system import (
    MAX_PENDING_BEFORE_INPUT,
    ClosedSystem,
    close,
)
from fsmkit.verify.statespace.exploration import End

LEAST_WIDTH = 2
MOST_WIDTH = 5
MOST_REACH = 2
"""The greatest distance between machines that are connected."""
EXPLORED = 8
"""The greatest value of the parameter that is explored when windows do not decide."""
SAMPLED = 4
"""Positions in the middle of the short ring in which conserved sums are looked for."""
BUILT_IN = ("deadlock", "livelock", "queue-overflow", "reachable-fault")
"""Rules of violated properties that no file has to name."""
QUICK_STATES = 500
"""Before views are computed, systems are explored up to the first one with more states."""
SIZE_SECONDS = 30.0
"""The time for a system of one size; what it leaves open is undecided."""
PYTHON_SECONDS = 5.0
"""The time that the search in Python has, before the generated C is compiled instead."""


@dataclass(frozen=True, slots=True)
class Abstraction:
    """A closed set of views: the certificate of a proof.

    ``width``: cells in a view. ``views``: how many. ``least``: the least value of the parameter for
    which it contains all views. ``sums``: the conserved sums. ``seconds``: the time for it.
    """

    method: str
    width: int
    views: int
    least: int
    sums: int
    seconds: float


@dataclass(frozen=True, slots=True)
class Explored:
    """A system that was explored: the value of the parameter and the number of states."""

    value: int
    states: int
    verdict: Verdict
    seconds: float


@dataclass(slots=True)
class Proof:
    """The result for a system with any number of machines.

    ``refuted``: the reports of explored systems that violate properties, by the value of the
    parameter. A result with a trace belongs to the first of them that names it.
    """

    family: Family
    findings: Findings
    results: tuple[Result, ...] = ()
    abstraction: Abstraction | None = None
    explored: list[Explored] = field(default_factory=list)
    refuted: dict[int, Report] = field(default_factory=dict)
    seconds: float = 0.0
    views: Windows | Multisets | None = None
    """The certificate: the last set of views that was computed."""

    @property
    def verdict(self) -> Verdict:
        """The worst of all verdicts."""
        verdicts = {result.verdict for result in self.results}
        errors = any(f.severity is Severity.ERROR for f in self.findings)
        if Verdict.VIOLATED in verdicts or errors:
            return Verdict.VIOLATED
        return Verdict.UNDECIDED if Verdict.UNDECIDED in verdicts else Verdict.HOLDS


def prove_file(
    path: Path,
    findings: Findings,
    *,
    parameters: Mapping[str, str],
    options: ExplorationOptions,
    properties: frozenset[str] = frozenset(),
    strict: bool = False,
    deadline: Deadline | None = None,
    progress: Callable[[str], None] | None = None,
) -> Proof:
    """Decide the properties of a system file for all values of the parameter that is ``any``.

    Raises `FsmkitError` if the system cannot be read, or is not uniform.
    """
    deadline = deadline or Deadline(options.timeout)
    began = time.monotonic()
    family = deadline.cut_off(
        Stage.READING, lambda: read_family(path, parameters, findings, strict=strict)
    )
    proof = Proof(family, findings)
    prover = _Prover(proof, options, properties, deadline, progress or (lambda _: None))
    try:
        prover.run()
    except TimeUp:
        prover.doubt = deadline.reached
    proof.results = prover.results()
    for result in proof.results:
        add_finding(result, findings)
    proof.seconds = time.monotonic() - began
    return proof


class _Prover:
    """The steps of a proof."""

    def __init__(
        self,
        proof: Proof,
        options: ExplorationOptions,
        properties: frozenset[str],
        deadline: Deadline,
        progress: Callable[[str], None],
    ) -> None:
        self.proof, self.family, self.options = proof, proof.family, options
        self.properties, self.deadline, self.progress = properties, deadline, progress
        self.claims = tuple(read_claims(self.family, properties))
        unknown = properties - {claim.name for claim in self.claims}
        for name in sorted(unknown):
            raise fail("unknown-name", f"the system has no property `{name}`")
        self.proved: set[str] = set()
        self.doubts: dict[str, str] = {}
        self.doubt = ""
        self.violated: dict[str, Result] = {}
        self.bounded = False
        """No queue overflows and no machine faults, in the views."""
        self.numbers = Numbers()
        self.weights: tuple[Weights, ...] | None = None

    def run(self) -> None:
        """Explore small systems; compute views of growing width; stop when all is decided."""
        explored = self.family.least - 1
        while explored < EXPLORED and not self._is_refuted:
            if not self._explore(explored + 1, is_quick=True):
                break
            explored += 1
            if self.proof.explored[-1].states > QUICK_STATES:
                break
        if self._is_refuted:
            return
        for width in range(LEAST_WIDTH, MOST_WIDTH + 1):
            least = self._abstract(width)
            bound = EXPLORED if least is None else least - 1
            if least is not None and not self._is_done:
                bound = max(bound, min(width + 3, EXPLORED))
            while explored < bound:
                explored += 1
                if not self._explore(explored):
                    return
            if self._is_done or least is None:
                break
        while not self._is_done and explored < EXPLORED:
            explored += 1
            if not self._explore(explored):
                return

    @property
    def _is_refuted(self) -> bool:
        """Whether all claims are violated, or a violation leaves nothing to prove."""
        names = {claim.name for claim in self.claims if claim.form is not None}
        is_unnamed = bool(self.violated.keys() - {claim.name for claim in self.claims})
        return is_unnamed or names <= self.violated.keys()

    @property
    def _is_done(self) -> bool:
        wanted = {claim.name for claim in self.claims if claim.form is not None}
        return self._is_refuted or (self.bounded and wanted <= self.proved | self.violated.keys())

    # --- views -----------------------------------------------------------------------------------

    def _abstract(self, width: int) -> int | None:
        """Decide claims by windows of a width; return the least value that they cover, or None."""
        self.progress(f"views of {width}")
        began = time.monotonic()
        try:
            views = self.deadline.cut_off(Stage.EXPLORING, lambda: self._views(width))
        except TooManyViewsError:
            self.doubt = f"there are too many views of {width} machines"
            return None
        least = max(self.family.least, self.family.value(views.least))
        self.proof.views = views
        self.bounded = not views.marks
        for claim in self.claims if self.bounded else ():
            if claim.form is not None and self._holds(views, claim):
                self.proved.add(claim.name)
        self.proof.abstraction = Abstraction(
            views.method, width, views.count, least, len(views.weights),
            time.monotonic() - began,
        )  # fmt: skip
        return least

    def _views(self, width: int) -> Windows | Multisets:
        """Return the views of a width, with the conserved sums that they show."""
        if self.family.is_symmetric:
            return Multisets(self._ring_of(width + 2), width)
        ring = self._ring(width, 1)
        if ring.reach > MOST_REACH:
            raise fail(
                RULE,
                f"machines {ring.reach} positions apart are connected",
                help="connect neighbours only, or give a number of machines",
            )
        while _enlarge_ends(ring):
            ring = self._ring(width, 1)
        if ring.reach > 1:
            ring = self._ring(width, ring.reach)
        width = max(width, ring.reach + 1)
        if self.weights is None:
            special = self.family.ends.low + self.family.ends.high
            self.weights = tuple(candidates(self._ring_of(special + SAMPLED)))
        while True:
            windows = Windows(ring, width, self.weights)
            wrong = not_conserved(windows)
            if not wrong:
                return windows
            self.weights = tuple(w for n, w in enumerate(self.weights) if n not in wrong)

    def _ring(self, width: int, reach: int) -> Ring:
        """Return the cells of a system that is long enough."""
        special = self.family.ends.low + self.family.ends.high
        return self._ring_of(Windows.longest(special, width, reach))

    def _ring_of(self, length: int) -> Ring:
        """Return the cells of a system with at least so many positions."""
        family = self.family
        length = max(length, family.ends.length, family.length(family.least))
        findings = Findings()
        value = family.value(length)
        try:
            system = family.system(value, findings)
        except FsmkitError as error:
            raise fail(
                RULE,
                f"the system has an error for {family.parameter}={value}: "
                f"{error.diagnostics[0].message}",
                None if (at := error.diagnostics[0].primary) is None else at.span,
                help=f"check it with `--set {family.parameter}={value}`",
            ) from error
        closed = closed_for_views(system, self.options, self._kept())
        return Ring(family, closed, self.numbers)

    def _kept(self) -> frozenset[str]:
        """Return the names of the properties that are decided."""
        return frozenset(claim.name for claim in self.claims if claim.form is not None)

    def _holds(self, views: Windows | Multisets, claim: Claim) -> bool:
        """Return whether the views prove a claim."""
        if claim.form is Form.DEADLOCK:
            return not views.may_deadlock()
        instances = Instances(views.ring, claim)
        if isinstance(views, Multisets) and instances.first is None:
            self.doubts[claim.name] = "it is not about each machine and the shared variables alone"
            return False
        if isinstance(views, Windows) and instances.width > views.width:
            self.doubts[claim.name] = f"it reads {instances.width} neighbouring machines"
            return False
        if claim.form is Form.AT_MOST:
            return views.bounds(instances, claim)
        return all(
            instances.holds(instance, snapshots) is not claim.negated
            for instance, snapshots in views.instances(instances)
        )

    # --- systems of one size ---------------------------------------------------------------------

    def _explore(self, value: int, *, is_quick: bool = False) -> bool:
        """Explore one system; return whether the proof goes on.

        ``is_quick``: only by the interpreter, and without a result if that takes long.
        """
        self.progress(f"{self.family.parameter}={value}")
        findings = Findings()
        system = self.family.system(value, findings)
        began = time.monotonic()
        report = self._report(system, findings, is_quick=is_quick)
        if report is None:
            return False
        found = report.exploration
        self.proof.explored.append(
            Explored(value, int(found.states), report.verdict, time.monotonic() - began)
        )
        self._note_violations(value, system, report)
        wanted = {claim.name: claim for claim in self.claims}
        for result in report.results:
            if result.verdict is Verdict.UNDECIDED and result.name in wanted:
                at = f"{self.family.parameter}={value}"
                self.doubts[result.name] = f"undecided for {at}: {result.reason}"
                self.proved.discard(result.name)
        if found.end is not End.COMPLETE and found.end is not End.DECIDED:
            self.doubt = f"{self.family.parameter}={value} was not explored completely"
            return False
        return True

    def _note_violations(self, value: int, system: System, report: Report) -> None:
        """Note the properties that this system is the first to violate, with their traces."""
        found = self._new_violations(report)
        if not found:
            return
        if report.exploration.engine == "python" and self.options.engine != "python":
            report = check(
                system, Findings(), options=self.options, properties=self.properties,
                deadline=self.deadline,
            )  # fmt: skip
            found = self._new_violations(report)
        self.proof.refuted[value] = report
        named = f"for {self.family.parameter}={value}"
        for finding in report.findings:
            if finding.rule.name in BUILT_IN:
                self.proof.findings.extend((finding,))
        for result in found:
            self.violated[result.name] = replace(result, reason=named)

    def _new_violations(self, report: Report) -> list[Result]:
        """Return the results that are violated for the first time; of unnamed ones the shortest."""
        names = {claim.name for claim in self.claims}
        violated = [result for result in report.results if result.verdict is Verdict.VIOLATED]
        found = [r for r in violated if r.name in names and r.name not in self.violated]
        others = [r for r in violated if r.name not in names]
        if others and not self.violated.keys() - names:
            found.append(min(others, key=lambda r: len(r.trace.steps) if r.trace else 0))
        return found

    def _deadline_in(self, seconds: float) -> Deadline:
        """Return a deadline in so many seconds, or that of the proof if it comes first."""
        self.deadline.look()
        return Deadline(min(seconds, max(self.deadline.left, 0.01)))

    def _report(self, system: System, findings: Findings, *, is_quick: bool) -> Report | None:
        """Explore a system by the interpreter if that is quick, otherwise by generated C."""
        if is_quick or self.options.engine != "c":
            quick = self._deadline_in(PYTHON_SECONDS)
            report = check(
                system, Findings(),
                options=replace(self.options, engine="python", shows=False),
                properties=self.properties, deadline=quick,
            )  # fmt: skip
            if report.exploration.end in (End.COMPLETE, End.DECIDED):
                return report
        if is_quick:
            return None
        return check(
            system,
            findings,
            options=self.options,
            properties=self.properties,
            deadline=self._deadline_in(SIZE_SECONDS),
        )

    # --- results ---------------------------------------------------------------------------------

    def results(self) -> tuple[Result, ...]:
        """Return a verdict for each claim."""
        names = {claim.name for claim in self.claims}
        others = (result for name, result in self.violated.items() if name not in names)
        return (
            *others,
            *(self.violated.get(claim.name) or self._result(claim) for claim in self.claims),
        )

    def _held(self, claim: Claim) -> Result:
        reason = f"for every {self.family.parameter} from {self.family.least} on"
        return Result(claim.name, claim.kind, claim.text, Verdict.HOLDS, reason, span=claim.span)

    def _result(self, claim: Claim) -> Result:
        complete = self.bounded and not self.doubt
        if claim.name in self.proved and complete:
            return self._held(claim)
        values = [each.value for each in self.proof.explored]
        why = claim.why or self.doubts.get(claim.name) or self.doubt
        if not why and not self.bounded:
            why = "a queue may overflow, or a machine may fault"
            why = "not decided after these violations" if self._is_refuted else why
        abstraction = self.proof.abstraction
        if not why and abstraction is not None:
            why = f"{abstraction.method} of {abstraction.width} cells do not prove it"
        if values:
            why += f"; explored for {self.family.parameter}={values[0]}..{values[-1]}"
        return _undecided(claim, why)


def _undecided(claim: Claim, why: str) -> Result:
    return Result(claim.name, claim.kind, claim.text, Verdict.UNDECIDED, why, span=claim.span)


def closed_for_views(
    system: System, options: ExplorationOptions, names: frozenset[str]
) -> ClosedSystem:
    """Return a system closed like the explored ones, without reductions.

    ``names``: the properties that are decided, whose data are distinguished. Raises `FsmkitError`
    for what has no proof for all sizes.
    """
    _require_plain(system)
    most = options.max_pending
    system = replace(system, properties=tuple(p for p in system.properties if p.name in names))
    closed = close(
        system,
        untimed=options.time == "untimed",
        silent=options.assume_watchdogs_silent,
        keeps_dead=True,
        max_pending=MAX_PENDING_BEFORE_INPUT if most is None else most,
    )
    if options.time == "zones" and closed.unit:
        raise fail(
            RULE,
            "dense time is not decided for any number of machines",
            help="use `--time discrete` or `--time untimed`",
        )
    for sample, use in closed.samples.items():
        raise fail(RULE, f"not every value of {sample} is tried: {use.text}", use.span)
    return closed


def _enlarge_ends(ring: Ring) -> bool:
    """Enlarge the ends by machines that start in another state than those in the middle.

    Return whether an end grew. Raises `FsmkitError` if an end would be too large.
    """
    ends, length = ring.family.ends, ring.length
    low, high = ends.low, ends.high
    for state in ring.initial():
        usual = state[(ends.low + length - ends.high) // 2]
        unusual = [p for p, cell in enumerate(state) if cell != usual and ring.kind(p) == 0]
        low = max([low, *(p + 1 for p in unusual if p < length // 2)])
        high = max([high, *(length - p for p in unusual if p >= length // 2)])
    if max(low, high) > MOST_ENDS:
        raise fail(
            RULE,
            "machines in the middle of the array start in different states",
            help="give them equal start values, or a number of machines",
        )
    is_changed = (low, high) != (ends.low, ends.high)
    ends.low, ends.high = low, high
    return is_changed


def _require_plain(system: System) -> None:
    """Reject systems with parts that are no machines of the array."""
    if system.freezers:
        raise fail(RULE, "nodes may freeze", system.freezers[0].machine.span)
    for monitor in system.monitors:
        raise fail(
            RULE,
            f"the property `{monitor.property}` has a monitor",
            monitor.machine.span,
            help="give a number of machines",
        )
    for machine in system.machines:
        if machine.chart.invocations:
            raise fail(RULE, f"`{machine.name}` invokes machines", machine.span)
