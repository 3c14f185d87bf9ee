"""Explore a closed system by one of the two engines, and evaluate the results."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import KW_ONLY, dataclass, replace
from math import isfinite, prod
from pathlib import Path

from fsmkit.chart.analysis.partition import COMBINED
from fsmkit.diagnostics import Findings, Span, fail
from fsmkit.diagnostics.suggestions import nearest_name
from fsmkit.language.units import duration_text
from fsmkit.system.any_file import NONE, load_any
from fsmkit.system.properties.property import AtStates, Builtin
from fsmkit.system.system import System
from fsmkit.verify.engines.c.engine import CEngine, compiler
from fsmkit.verify.engines.python.oracle import explore_in_python
from fsmkit.verify.properties.dense import cycle_place, temporal_answers
from fsmkit.verify.report.counterexample import Counterexample, ReplayError, write
from fsmkit.verify.report.verdict import (
    Report,
    Result,
    Show,
    Verdict,
    add_finding,
    conclude,
    overflowing,
)
from fsmkit.verify.resources.deadline import Deadline, Stage, TimeUp
from fsmkit.verify.resources.time import TIMES, Time
from fsmkit.verify.statespace.closed_system import (
    MAX_PENDING_BEFORE_INPUT,
    UNLIMITED,
    ClosedSystem,
    close,
    unexplored_system,
    zones_rejection,
)
from fsmkit.verify.statespace.exploration import DEADLOCK, End, Exploration, Trail, unexplored
from fsmkit.verify.statespace.ranks import Ranks, why_not_ranks
from fsmkit.verify.statespace.storage import Storage
from fsmkit.verify.statespace.symbolic_search import (
    Search,
    explicit_only,
    why_not_symbolic,
)

DEAD = "dead"
"""The reduction that resets data which nothing can read any more (`statespace.dead_variables`)."""
SLEEP = "sleep"
"""Partial-order reduction by sleep sets (core/search/sleep_sets.h)."""
REDUCTIONS = (DEAD, SLEEP)
"""The names of all reductions."""

ENGINES = ("", "c", "python")
MOST_STEPS = {"c": 50_000_000, "python": 200_000}
"""Where samples decide not: every value is tried if that takes at most so many steps, by engine."""
MOST_SECONDS = 10.0
"""And at most so long, as states may be more than the samples led to."""
RANGES = {
    "memory": (1, 1 << 62),
    "workers": (0, 1 << 10),
    "timeout": (0, 1_000_000_000),
    "max_pending": (0, UNLIMITED),
}
"""The minimum and the maximum of numeric options; only ``timeout`` may have a fraction."""
Progress = Callable[[int, int, int], None]
"""Called now and then with states, transitions and depth."""


def _require_number(name: str, value: object, least: int, most: int) -> None:
    if value is None and name == "max_pending":
        return
    kinds = (int, float) if name == "timeout" else (int,)
    if not isinstance(value, kinds) or not least <= value <= most:
        raise fail(
            "wrong-option", f"`{name}` cannot be {value!r}", help=f"give {least:,} to {most:,}"
        )


@dataclass(frozen=True, slots=True)
class ExplorationOptions:
    """How to explore, by the names and with the values of `fsmkit.check`.

    ``engine``: ``c``, ``python``, or empty for C if there is a compiler. The engine in Python has
    no zones: it uses discrete time instead. ``timeout``: seconds (0: none). ``workers`` (0: all
    cores) do not change the results, unless a lossy ``storage`` misses states.
    """

    engine: str = ""
    _: KW_ONLY
    time: Time = "zones"
    assume_watchdogs_silent: bool = False
    memory: int = 4 << 30
    timeout: float = 0
    workers: int = 1
    reductions: frozenset[str] = frozenset(REDUCTIONS)
    storage: Storage = Storage.EXACT
    seed: int = 0
    """The seed of the hashes of lossy storage: with another one other states are missed."""
    search: Search = Search.AUTO
    order: tuple[str, ...] = ()
    """Names of machines, those of the highest levels of a diagram first; the others follow."""
    max_pending: int | None = None
    """Events that may wait when an external one occurs (`UNLIMITED`: it never waits). None: 1,
    but in a requested symbolic search no limit if queues do not overflow by that."""
    covers: bool = False
    """A way to each transition and each state is kept, for `verify.testgen.cover`."""
    ends_at: frozenset[str] = frozenset()
    """The exploration ends once one of these properties is violated, if states decide it."""
    ranks: Ranks | None = None
    """Several processes, by MPI; ``memory`` is then that of each."""
    shows_locals: bool = False
    """The local states of all machines are kept (`Figures.saved`), where the engine in C explores
    each state by itself."""
    shows: bool = True
    """Runs to what was found are written and replayed; of an open chart always."""
    objects: Path | None = None
    """A folder where compiled parts of explorers are kept for the next one with the same parts."""

    def __post_init__(self) -> None:
        """Reject unknown values, and silent watchdogs with timed exploration."""
        for what, value, known in (
            ("kind of time", self.time, TIMES),
            ("engine", self.engine, ENGINES),
        ):
            if value not in known:
                raise fail(
                    "unexpected-value",
                    f"there is no {what} `{value}`",
                    help=f"use one of {', '.join(filter(None, known))}",
                )
        for name, (least, most) in RANGES.items():
            _require_number(name, getattr(self, name), least, most)
        if self.assume_watchdogs_silent and self.time != "untimed":
            raise fail(
                "unexpected-value",
                "watchdogs can be silent only where time is untimed",
                help='use `time="untimed"` with it',
            )
        for name in sorted(self.reductions.difference(REDUCTIONS)):
            raise fail(
                "no-such-reduction",
                f"there is no reduction `{name}`",
                help=f"use one of {', '.join(REDUCTIONS)}",
            )

    @property
    def threads(self) -> int:
        """The number of cores to use."""
        if self.workers:
            return self.workers
        if hasattr(os, "sched_getaffinity"):
            return len(os.sched_getaffinity(0))
        return os.cpu_count() or 1

    def closed(self, system: System, *, zones: bool, enumerated: int = 0) -> ClosedSystem:
        """Return a system closed for these options; ``zones`` if the engine has them.

        ``enumerated``: as for `statespace.closed_system.close`.
        """
        return close(
            system,
            untimed=self.time == "untimed",
            silent=self.assume_watchdogs_silent,
            zones=zones,
            covers=self.covers,
            keeps_dead=DEAD not in self.reductions,
            enumerated=enumerated,
            max_pending=MAX_PENDING_BEFORE_INPUT if self.max_pending is None else self.max_pending,
        )


def check_file(
    path: Path,
    findings: Findings,
    *,
    replacing: Mapping[str, Path] | None = None,
    strict: bool = False,
    wires: Sequence[Path] = (),
    parameters: Mapping[str, str] = NONE,
    options: ExplorationOptions | None = None,
    properties: frozenset[str] = frozenset(),
    progress: Progress | None = None,
    deadline: Deadline | None = None,
) -> tuple[System, Report]:
    """Read a system, or a chart alone, and check it; the ``deadline`` includes reading.

    ``replacing``, ``strict``, ``wires``, ``parameters``: as for `fsmkit.system.any_file.load_any`.
    If time ends during reading, the reported system has no machines.
    """
    options = options or ExplorationOptions()
    deadline = deadline or Deadline(options.timeout)
    try:
        read = deadline.cut_off(
            Stage.READING,
            lambda: load_any(
                path, findings, replacing, strict=strict, wires=wires, parameters=parameters
            ),
        )
    except TimeUp:
        read = System(path.stem, ())
        return read, _out_of_time(read, options, frozenset(), findings, deadline)
    report = check(
        read, findings, options=options, properties=properties, progress=progress, deadline=deadline
    )
    return read, report


def check(
    system: System,
    findings: Findings,
    *,
    options: ExplorationOptions | None = None,
    properties: frozenset[str] = frozenset(),
    progress: Progress | None = None,
    deadline: Deadline | None = None,
) -> Report:
    """Explore a system and return the verdicts; ``properties`` limits the evaluated ones.

    The ``deadline`` includes all of it; without one, the timeout of the options starts now. If time
    ends before the exploration starts, nothing is decided.
    """
    options = options or ExplorationOptions()
    deadline = deadline or Deadline(options.timeout)
    _require_known(system, properties)
    try:
        return _with_times(
            _check(system, findings, options, properties, progress, deadline), deadline
        )
    except TimeUp:
        return _out_of_time(system, options, properties, findings, deadline)


def _out_of_time(
    system: System,
    options: ExplorationOptions,
    properties: frozenset[str],
    findings: Findings,
    deadline: Deadline,
) -> Report:
    """Return the report of an unexplored system: nothing is decided."""
    why = deadline.reached
    asked = [p for p in system.properties if not properties or p.name in properties]
    results = [Result(p.name, p.kind, p.text, Verdict.UNDECIDED, why, span=p.span) for p in asked]
    results = results or [Result(system.name, None, "", Verdict.UNDECIDED, why)]
    for result in results:
        add_finding(result, findings)
    found = unexplored(options.engine or "c", why, len(system.machines))
    return _with_times(
        Report(unexplored_system(system), found, tuple(results), findings, ()), deadline
    )


def _with_times(report: Report, deadline: Deadline) -> Report:
    return replace(report, spent={s.value: seconds for s, seconds in deadline.spent.items()})


def _check(
    system: System,
    findings: Findings,
    options: ExplorationOptions,
    properties: frozenset[str],
    progress: Progress | None,
    deadline: Deadline,
) -> Report:
    engine = options.engine or ("c" if compiler() is not None else "python")
    zones = options.time == "zones" and engine == "c"
    beyond = zones_rejection(system) if zones else None
    dense = zones and beyond is None
    closed = deadline.cut_off(Stage.GENERATING, lambda: options.closed(system, zones=dense))
    if beyond is not None:
        _note_discrete_time(closed, findings, *beyond)
    _require_stored(options.storage, engine, closed)
    _require_symbolic(options, engine, closed)
    _require_ranks(options, engine, closed)
    if not options.engine and engine == "python":
        findings.add(
            "no-compiler",
            "there is no C compiler: exploring in Python, which is slow",
            None,
            help="install `cc`, or name a compiler in the environment variable CC",
        )

    def explore(closed: ClosedSystem, findings: Findings, seconds: float = 0) -> Report:
        return _explore(closed, findings, options, engine, properties, progress, deadline, seconds)

    if not closed.samples:
        return explore(closed, findings)
    own = Findings()
    report = explore(closed, own)
    if any(result.verdict is Verdict.UNDECIDED for result in report.results):
        whole = options.closed(system, zones=dense, enumerated=COMBINED)
        if not whole.samples and _steps_of_all(report, whole) <= MOST_STEPS[engine]:
            tried = Findings()
            every = explore(whole, tried, MOST_SECONDS)
            if every.exploration.end is End.COMPLETE:
                report, own = every, tried
    findings.extend(own)
    return replace(report, findings=findings)


def _steps_of_all(report: Report, whole: ClosedSystem) -> int:
    """Estimate the steps of a search over all values, from the states reached by samples."""
    inputs = prod(len(each.values) for each in whole.free_inputs)
    results = sum(len(values) for each in whole.results for values in each.values())
    return report.exploration.states * (len(whole.possible) + inputs + results)


def _explore(
    closed: ClosedSystem,
    findings: Findings,
    options: ExplorationOptions,
    engine: str,
    properties: frozenset[str],
    progress: Progress | None,
    deadline: Deadline,
    seconds: float,
) -> Report:
    """Explore a closed system for ``seconds`` at most (0: to the deadline); return the verdicts."""
    until = _deciding_marks(closed, properties)
    fatal = _fatal_marks(closed, options.ends_at)
    if engine == "python":
        found, trail_of = explore_in_python(
            closed, traps=closed.is_open, deadline=deadline, progress=progress, until=until
        )

        def trail(path: tuple[int, ...]) -> Trail:
            return deadline.cut_off(Stage.REPLAYING, lambda: trail_of(path))

        return conclude(
            closed, found, _counterexample_writer(closed, deadline, trail), properties, findings
        )
    if options.max_pending is None and options.search is Search.SYMBOLIC:
        report = _without_limit(closed, findings, options, properties, progress, deadline)
        if isinstance(report, Report):
            return report
        closed = replace(closed, overflowing=report)
    built_by = CEngine(
        closed, findings, deadline, options.objects, options.ranks, properties=properties
    )
    with closing(built_by) as built:
        found = _search(built, options, progress, until, fatal, seconds)
        if closed.zones:
            memory = options.memory
            answers = temporal_answers(built, closed, found, memory, progress, properties)
            found = replace(found, temporal=answers)
        show = _counterexample_writer(
            closed, deadline, built.trail, built.confirm, shows=options.shows
        )
        report = conclude(closed, found, show, properties, findings)
        return replace(report, interrupted=built.interrupted)


def _note_discrete_time(
    closed: ClosedSystem, findings: Findings, why: str, where: Span | None
) -> None:
    unit = duration_text(closed.unit * closed.system.machines[0].chart.capacities.tick)
    findings.add(
        "discrete-time",
        f"time is discrete in this check, not dense: {why}",
        where,
        help=f"events strictly between two multiples of {unit} are not explored; "
        "`--time untimed` covers all times",
    )


def _without_limit(
    closed: ClosedSystem,
    findings: Findings,
    options: ExplorationOptions,
    properties: frozenset[str],
    progress: Progress | None,
    deadline: Deadline,
) -> Report | tuple[int, ...]:
    """Search symbolically with external events that never wait; return the result.

    The search has half of the memory, and of the time. If it does not complete, or if queues
    overflow, the machines of those queues are returned instead. An interrupt is raised.
    """
    hasty = replace(closed, max_pending=UNLIMITED)
    own = Findings()
    with closing(CEngine(hasty, own, deadline, options.objects, properties=properties)) as built:
        seconds = deadline.left / 2 if isfinite(deadline.left) else 0
        until, fatal = _deciding_marks(hasty, properties), _fatal_marks(hasty, options.ends_at)
        half = replace(options, memory=options.memory // 2)
        found = _search(built, half, progress, until, fatal, seconds)
        if built.interrupted:  # its verdicts would have another assumption
            raise KeyboardInterrupt
        lost = overflowing(hasty, found)
        if lost or found.end not in (End.COMPLETE, End.DECIDED):
            return lost
        findings.extend(own)
        show = _counterexample_writer(
            hasty, deadline, built.trail, built.confirm, shows=options.shows
        )
        return conclude(hasty, found, show, properties, findings)


def _search(
    built: CEngine,
    options: ExplorationOptions,
    progress: Progress | None,
    until: frozenset[int] = frozenset(),
    fatal: frozenset[int] = frozenset(),
    seconds: float = 0,
) -> Exploration:
    search, order = options.search, _machine_numbers(built.closed.system, options.order)
    if why_not_symbolic(built.closed, options.storage) or (fatal and search is Search.AUTO):
        search = Search.EXPLICIT
    if options.ranks is not None:
        search = Search.EXPLICIT

    def run(search: Search) -> Exploration:
        return built.explore(
            options.memory,
            seconds,
            progress,
            until,
            options.threads,
            options.storage,
            sleeps=SLEEP in options.reductions,
            search=search,
            order=order,
            fatal=fatal,
            seed=options.seed,
            shows_locals=options.shows_locals,
        )

    needs_graph = any(True for _ in explicit_only(built.closed, built.asked))
    if search is Search.AUTO and needs_graph:
        graph = run(Search.EXPLICIT)
        if graph.end is not End.MEMORY:
            return graph
        found = run(Search.SYMBOLIC)  # properties that do not need the graph may still be decided
        if found.end is not End.COMPLETE:
            return graph
        return _with_graph(built.closed, found, graph)
    found = run(search)
    if search is not Search.SYMBOLIC or found.end is not End.COMPLETE or not needs_graph:
        return found
    return _with_graph(built.closed, found, run(Search.EXPLICIT))


def _with_graph(closed: ClosedSystem, found: Exploration, graph: Exploration) -> Exploration:
    """Complete the result of a symbolic search by what the graph of all states shows."""
    steps = {1 + n for n, p in enumerate(closed.system.properties) if p.is_of_steps}
    marks = (*found.marks, *(mark for mark in graph.marks if mark.number in steps))
    missing = steps if graph.end is not End.COMPLETE else set()
    diagram = found.diagram
    if diagram is not None:
        diagram = replace(diagram, unknown=diagram.unknown | missing)
    return replace(
        found,
        marks=tuple(sorted(marks, key=lambda mark: mark.number)),
        temporal=tuple(own if own.known else found.answer(own.property) for own in graph.temporal),
        diagram=diagram,
        explicit_states=graph.states,
        seconds=found.seconds + graph.seconds,
    )


def _machine_numbers(system: System, names: Sequence[str]) -> tuple[int, ...]:
    """Return the machines of an order by number. Raises `FsmkitError` for an unknown one."""
    places = {machine.name: number for number, machine in enumerate(system.machines)}
    for name in names:
        if name not in places:
            near = nearest_name(name, places)
            known = ", ".join(places)
            raise fail(
                "no-such-search",
                f"there is no machine `{name}` to be ordered",
                help=f"did you mean `{near}`?" if near is not None else f"there are {known}",
            )
    return tuple(places[name] for name in names)


def _require_symbolic(options: ExplorationOptions, engine: str, closed: ClosedSystem) -> None:
    """Reject an explicit request for a symbolic search that is not possible."""
    if options.search is not Search.SYMBOLIC:
        return
    why = why_not_symbolic(closed, options.storage)
    if engine == "python":
        why = "the engine in Python keeps states one by one"
    _reject_search("symbolic search", why, "--search", closed)


def _require_ranks(options: ExplorationOptions, engine: str, closed: ClosedSystem) -> None:
    """Reject several processes if the options need one process."""
    if options.ranks is None:
        return
    why = why_not_ranks(closed, options.storage, options.search)
    if engine == "python":
        why = "the engine in Python is one process"
    _reject_search("a search by several ranks", why, "--mpi", closed)


def _reject_search(search: str, why: str, option: str, closed: ClosedSystem) -> None:
    """Reject a search if there is a reason."""
    if why:
        way_out = "use `--time discrete` or `--time untimed`, or " if closed.zones else ""
        raise fail(
            "no-such-search",
            f"a {search} is not possible here: {why}",
            help=f"{way_out}leave `{option}` out",
        )


def _require_stored(storage: Storage, engine: str, closed: ClosedSystem) -> None:
    """Reject a lossy storage that the search does not support."""
    if storage is Storage.EXACT or (engine != "python" and not closed.zones):
        return
    what, way_out = "zones are kept", "use `--time discrete` or `--time untimed`"
    if engine == "python":
        what, way_out = "the engine in Python keeps states", "use the engine in C"
    raise fail(
        "no-such-storage",
        f"the storage `{storage.value}` is not possible here: {what} exactly",
        help=f"{way_out}, or remove `--storage`",
    )


def _counterexample_writer(
    closed: ClosedSystem,
    deadline: Deadline,
    trail_of: Callable[[tuple[int, ...]], Trail],
    confirm: Callable[[Counterexample, tuple[int, ...]], Counterexample] | None = None,
    *,
    shows: bool = True,
) -> Show:
    def shown(path: tuple[int, ...], cycle: tuple[int, ...]) -> Counterexample:
        whole = (*path, *cycle)
        trail = trail_of(whole)
        split = (
            cycle_place(trail, sum(n >= 0 for n in cycle))
            if closed.zones
            else len(trail) - len(cycle)
        )
        try:
            found = deadline.cut_off(
                Stage.REPLAYING, lambda: write(closed, trail[:split], trail[split:])
            )
        except ReplayError as error:
            return Counterexample((), trail, None, (), str(error))
        return found if confirm is None else confirm(found, whole)

    given_up = not shows and not closed.is_open  # a run of an open chart shows whether it is a trap

    def show(path: tuple[int, ...], cycle: tuple[int, ...]) -> Counterexample | None:
        nonlocal given_up  # after a timeout or an interrupt, report the known results at once
        try:
            return None if given_up else shown(path, cycle)
        except (TimeUp, KeyboardInterrupt):
            given_up = True
            return None

    return show


def _deciding_marks(closed: ClosedSystem, properties: frozenset[str]) -> frozenset[int]:
    """Return the marks that decide all requested properties; empty if some have no mark."""
    found = set()
    for number, property_ in enumerate(closed.system.properties):
        if property_.name not in properties:
            continue
        decided = property_.kind.decided
        if decided is Builtin.DEADLOCK and not closed.is_open:
            found.add(DEADLOCK)
        elif property_.is_of_steps and closed.zones:
            return frozenset()
        elif isinstance(decided, AtStates):
            found.add(1 + number)
        else:
            return frozenset()
    return frozenset(found)


def _fatal_marks(closed: ClosedSystem, names: frozenset[str]) -> frozenset[int]:
    """Return the marks of states that violate one of these properties."""
    found = set()
    for number, property_ in enumerate(closed.system.properties):
        decided = property_.kind.decided
        if property_.name not in names or (property_.is_of_steps and closed.zones):
            continue
        if isinstance(decided, AtStates) and not decided.existential:
            found.add(1 + number)
        elif decided is Builtin.DEADLOCK and not closed.is_open:
            found.add(DEADLOCK)
    return frozenset(found)


def with_properties(system: System, properties: frozenset[str]) -> System:
    """Return a system with only the named properties and their monitors (empty: all).

    Raises `FsmkitError` (``no-such-property``).
    """
    if not properties:
        return system
    _require_known(system, properties)
    return replace(
        system,
        properties=tuple(p for p in system.properties if p.name in properties),
        monitors=tuple(m for m in system.monitors if m.property in properties),
    )


def _require_known(system: System, properties: frozenset[str]) -> None:
    known = {property_.name for property_ in system.properties}
    for name in sorted(properties - known):
        near = nearest_name(name, known)
        hint = "" if near is None else f"did you mean `{near}`? "
        raise fail(
            "no-such-property",
            f"`{system.name}` has no property `{name}`",
            None,
            help=f"{hint}there are {', '.join(sorted(known))}" if known else "it has none",
        )


def explore(
    system: System,
    findings: Findings,
    options: ExplorationOptions,
    progress: Progress | None = None,
) -> Exploration:
    """Return the result of an exploration, without evaluating it."""
    zones = options.time == "zones" and options.engine != "python"
    closed = options.closed(system, zones=zones)
    deadline = Deadline(options.timeout)
    _require_stored(options.storage, options.engine, closed)
    if options.engine == "python":
        found, _ = explore_in_python(
            closed, traps=closed.is_open, deadline=deadline, progress=progress
        )
        return found
    with closing(CEngine(closed, findings, deadline)) as built:
        return _search(built, options, progress)
