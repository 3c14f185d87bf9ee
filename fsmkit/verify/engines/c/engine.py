"""The engine in C: generate the model, compile it once for each content, run it, read its output.

The program consists of the machines as `fsmkit compile` writes them, the binding, and
``verify/core``. The user's cache keeps it under the hash of all its sources.
"""

from __future__ import annotations

import math
import os
import shutil
import signal
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.c.limits import report_limits
from fsmkit.diagnostics import Findings, fail
from fsmkit.diagnostics.parsing import parse_json
from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.runtime.library import C_LIBRARY
from fsmkit.system.indices import MOST_ELEMENTS
from fsmkit.system.properties.property import OverGraph, goal_place, temporal_properties
from fsmkit.verify.engines.c.binding import BoundMachine, bind, options_for, prefix_of
from fsmkit.verify.engines.c.binding_system import system_file
from fsmkit.verify.engines.c.build import Builder
from fsmkit.verify.engines.c.concretize import PerformedStep, Point, schedule_path, with_points
from fsmkit.verify.engines.c.mpi import (
    OVERSUBSCRIBED,
    checkpoint_options,
    identity_of,
    launcher,
    mpi_compiler,
    rank_failed,
)
from fsmkit.verify.engines.c.orders import keep_order, kept_order
from fsmkit.verify.engines.c.output import (
    difference,
    natural,
    parse_lines,
    performed_steps,
    unfinished_result,
)
from fsmkit.verify.engines.c.shapes import shapes_of
from fsmkit.verify.engines.c.symbolic_search import read_diagram, symbolic_options, why_unknown
from fsmkit.verify.engines.c.used_elements import cut_arrays
from fsmkit.verify.report.counterexample import Counterexample, explorer_output, explorer_state
from fsmkit.verify.resources.children import ChildResult, run
from fsmkit.verify.resources.deadline import Deadline, Stage, TimeUp
from fsmkit.verify.statespace.actions import Action, Step
from fsmkit.verify.statespace.closed_system import ClosedSystem, with_greatest_delays
from fsmkit.verify.statespace.exploration import (
    AT_ONCE,
    IDLE,
    Answer,
    End,
    Exploration,
    Figures,
    Mark,
    Trail,
)
from fsmkit.verify.statespace.ranks import NEEDS_ONE, Ranks, read_traffic
from fsmkit.verify.statespace.spread import read_spread
from fsmkit.verify.statespace.storage import Storage, read_table
from fsmkit.verify.statespace.symbolic_search import Search

CORE = Path(__file__).parents[2] / "core"
FLAGS = ("-std=gnu99", "-O2", "-pthread", "-fwrapv", "-w", '-DFSM_HOOKS="system/hooks.h"')
MOST_NARROW = 64
WIDE = (f"-DFSM_MOST_MACHINES={MOST_ELEMENTS}",)
"""Flags for systems of more machines than ``core/system/system.h`` supports by default."""
FOR_RANKS = ("-DFSM_MPI",)
"""For a program that can be one of several processes (``core/mpi``)."""
FOR_LARGE = ("-include", "large.h")
"""For the code of machines whose states are many: so that it is compiled in time."""
COPIED = ("fsm.h", "fsm_info.h", "fsm_bytes.h", "fsm_save.h", "fsm_save.c")
"""The files of the library of generated C that the search needs."""
NO_MEMORY = 3
"""Its exit code if there is not enough memory to start."""
MOST_FOR_PATHS = 2.0
"""Seconds at most, of those that are left, that are kept for the ways to what was found."""
OVERDUE = 0.3
"""Seconds that it has after its deadline to say its result."""
Progress = Callable[[int, int, int], None]


def compiler() -> str | None:
    """Return the path of the C compiler: that of CC, else cc, gcc or clang; None without one."""
    names = [os.environ["CC"]] if os.environ.get("CC") else ["cc", "gcc", "clang"]
    return next((path for name in names if (path := shutil.which(name)) is not None), None)


def model_files(closed: ClosedSystem, findings: Findings) -> dict[str, str]:
    """Return the C of a closed system: machines, bindings, wires."""
    files: dict[str, str] = {}
    built: dict[int, BoundMachine] = {}
    for shape in shapes_of(closed.charts):
        first = shape.machines[0]
        long_waiting = with_greatest_delays(shape.chart)
        own = Findings()
        report_limits(long_waiting, own)
        if own.has_errors:
            findings.extend(own)
            findings.stop_on_errors()
        options = options_for(shape.chart, observes_reads=bool(closed.read_inputs))
        prefix = prefix_of(first, closed.system.machines[first].name)
        machines, own_files = bind(closed, shape, generate_machine(long_waiting, prefix, options))
        built |= {machine.number: machine for machine in machines}
        files |= own_files
    files["explore_system.c"] = system_file(closed, [built[number] for number in range(len(built))])
    return files


class CEngine:
    """A compiled explorer of one closed system."""

    def __init__(
        self,
        closed: ClosedSystem,
        findings: Findings,
        deadline: Deadline | None = None,
        objects: Path | None = None,
        ranks: Ranks | None = None,
        properties: frozenset[str] = frozenset(),
    ) -> None:
        """Generate and compile, or use the cache. Raises `FsmkitError` if that fails.

        Everything keeps to the ``deadline``; `TimeUp` is raised when it passes. ``objects``: as for
        `Builder`. ``ranks``: run as several processes. ``properties``: the temporal properties to
        decide (empty: all).
        """
        self._closed = closed
        self._ranks = ranks
        self.interrupted = False
        self.asked = properties
        self._deadline = deadline or Deadline()
        command = compiler() if ranks is None else mpi_compiler()
        if command is None:
            raise fail(
                "no-c-compiler",
                "there is no C compiler",
                help="install `cc`, name one in CC, or use `--engine python`",
            )
        generating = self._deadline.cut_off
        self._cut = generating(Stage.GENERATING, lambda: cut_arrays(closed))
        files = generating(Stage.GENERATING, lambda: model_files(self._cut.closed, findings))
        sources = {path.relative_to(CORE): path for path in sorted(CORE.rglob("*.[ch]"))}
        if ranks is None:
            sources = {name: path for name, path in sources.items() if name.parts[0] != "mpi"}
        sources |= {Path(name): C_LIBRARY / name for name in COPIED}
        core = {name.as_posix(): path.read_text() for name, path in sources.items()}
        wide = WIDE if len(closed.charts) > MOST_NARROW else ()
        flags = (*FLAGS, *wide, *FOR_RANKS[: int(ranks is not None)])
        self._identity = "" if ranks is None else identity_of(core, files)
        self._builder = Builder((command, *flags), self._deadline, findings, objects)
        try:
            is_large = any(options_for(chart).is_small for chart in closed.charts)
            self.program = self._builder.program(core, files, FOR_LARGE if is_large else ())
        except BaseException:
            self.close()
            raise

    @property
    def closed(self) -> ClosedSystem:
        """The explored system."""
        return self._closed

    def close(self) -> None:
        """Remove the files that are not in the cache."""
        self._builder.close()

    # --- running -------------------------------------------------------------------------------

    def explore(
        self,
        memory: int,
        seconds: float,
        progress: Progress | None,
        until: frozenset[int] = frozenset(),
        cores: int = 1,
        storage: Storage = Storage.EXACT,
        *,
        sleeps: bool = True,
        search: Search = Search.EXPLICIT,
        order: Sequence[int] = (),
        fatal: frozenset[int] = frozenset(),
        seed: int = 0,
        slots: bool = False,
        shows_locals: bool = False,
    ) -> Exploration:
        """Explore all states, or until all marks of ``until`` were seen. An interrupt ends it.

        ``order``: machines by level of a diagram, the highest first; if empty, one is computed.
        ``fatal``: marks the first of which ends it. ``shows_locals``: local states are kept, as in
        `Figures.saved`. ``seed``: of the hashes, if only a part of a state is stored. ``slots``:
        for tests, each queue is levels of a diagram from the start.
        """
        asked = ["--livelock"] + ["--sleepless"] * (not sleeps)
        if fatal:
            asked += ["--until-any", ",".join(map(str, sorted(fatal)))]
        elif until:
            asked += ["--until", ",".join(map(str, sorted(until)))]
        command = [str(self.program), *asked, "--memory", str(memory), *self.limits(seconds)]
        if self._ranks is not None:
            identity = identity_of({"program": self._identity}, dict.fromkeys(asked, ""))
            saved = checkpoint_options(self._ranks, identity)
            ahead = launcher(self._ranks)
            return self._read(self.result([*ahead, *command, "--ranks", *saved], progress))
        command += ["--cores", str(cores), "--storage", storage.value]
        command += ["--seed", str(seed)] if seed else []
        if shows_locals:
            command += ["--locals", ",".join(map(str, range(len(self._closed.charts))))]
        command += ["--traps"] * self._closed.is_open
        command += [] if self._closed.zones else self.temporal_options()
        if search is Search.EXPLICIT:
            return self._read(self.result(command, progress))
        kept = () if order else kept_order(self.program, len(self._closed.charts))
        command += symbolic_options(self._closed, search, order or kept, until)
        command += ["--slots"] * slots
        return self._with_order(self._read(self.result(command, progress)), is_kept=bool(kept))

    def _with_order(self, found: Exploration, *, is_kept: bool) -> Exploration:
        """Keep the order of a complete diagram for later runs, and record its origin."""
        if found.diagram is None:
            return found
        if found.end is End.COMPLETE:
            keep_order(self.program, found.diagram)
        by = "kept" if is_kept else found.diagram.found_by
        return replace(found, diagram=replace(found.diagram, found_by=by))

    @property
    def _decidable(self) -> tuple[int, ...]:
        properties = self._closed.system.properties
        found = temporal_properties(properties, untimed=self._closed.untimed)
        return tuple(n for n in found if not self.asked or properties[n].name in self.asked)

    def temporal_options(self, numbers: Sequence[int] = ()) -> list[str]:
        """Return the options for temporal properties, in their order; if empty, for all."""
        properties = self._closed.system.properties
        found = ["--timeless"] if self._closed.is_timeless else []
        for number in numbers or self._decidable:
            property_ = properties[number]
            decided = property_.kind.decided
            if not isinstance(decided, OverGraph):
                continue
            operands = [1 + number]
            operands += [1 + goal_place(properties, number)] * (property_.goal is not None)
            operands += [property_.ticks // (self._closed.unit or 1)] * decided.is_timed
            found += [f"--{decided.procedure}", ",".join(map(str, operands))]
        return found

    def watch(
        self, begin: int, end: int, most: int, memory: int, seconds: float
    ) -> tuple[Exploration, Mapping[str, Any]]:
        """Explore with a clock that runs from one property's start until another holds.

        Only in zones. Also returns the values of the clock (``watch`` in core/zones/timed_main.c);
        beyond ``most`` units it shows only that it is more.
        """
        command = [str(self.program), "--memory", str(memory), "--watch", f"{begin},{end},{most}"]
        command += self.limits(seconds)
        record = self.result(command, None)
        return self._read(record), record["watch"]

    def shown(self) -> frozenset[tuple[str, ...]]:
        """Return all observable states of the machines: active leaves and data, as in traces.

        Only in zones.
        """
        command = [str(self.program), "--list"]
        done = self._run(command)
        if done.code:
            raise fail("explorer-build", f"the explorer ended with code {done.code}")
        return frozenset(lines for own, lines in parse_lines(done.out) if "part" in own)

    def limits(self, seconds: float) -> list[str]:
        """Return the options that end a search after so long (0: never), or at the deadline.

        A part of that time is reserved for the paths to the results, and for the replay.
        """
        left = self._deadline.left
        search = min(seconds or math.inf, max(0.001, left - min(MOST_FOR_PATHS, left / 10)))
        found = [] if search == math.inf else ["--timeout", f"{search:.3f}"]
        return found if left == math.inf else [*found, "--paths", f"{max(0.001, left):.3f}"]

    def result(self, command: list[str], progress: Progress | None) -> Mapping[str, Any]:
        """Return the result that the program prints (``core/main.c``).

        If it prints none because time or memory ran out, the result says so, with the progress.
        """
        last: dict[str, int] = {}
        began = time.monotonic()

        def spent() -> float:
            return time.monotonic() - began

        def line(text: str) -> None:
            if text.startswith('{"progress"'):
                last.update(parse_json(text)["progress"])
                if progress is not None:
                    progress(last["states"], last["transitions"], last["depth"])

        if self.interrupted:
            return unfinished_result(End.INTERRUPTED, "", last, spent())
        try:
            with self._deadline.stage(Stage.EXPLORING):
                done = self._run([*command, "--progress"], line, stops=True)
                self.interrupted = self.interrupted or done.interrupted
        except TimeUp:
            return unfinished_result(End.TIME, "", last, spent())
        if done.code == 0:
            result: Mapping[str, Any] = parse_json(done.out, parse_int=natural)["result"]
            return result
        if done.code == NO_MEMORY:
            return unfinished_result(End.MEMORY, "", last, spent())
        if done.interrupted:
            return unfinished_result(End.INTERRUPTED, "", last, spent())
        if self._ranks is not None:
            raise rank_failed(self._ranks, done)
        if done.code == -signal.SIGKILL:
            why = "something ended the explorer, as a system does that runs out of memory"
            return unfinished_result(End.FAILED, why, last, spent())
        raise fail(
            "explorer-build",
            f"the explorer ended with code {done.code} and without a result",
            help="use `--engine python`, and please report it",
        )

    def _run(
        self, command: list[str], line: Callable[[str], None] | None = None, *, stops: bool = False
    ) -> ChildResult:
        try:
            seconds = self._deadline.left + OVERDUE
            environment = None if self._ranks is None else OVERSUBSCRIBED
            return run(command, seconds=seconds, line=line, stops=stops, environment=environment)
        except OSError as error:
            reason = (error.strerror or type(error).__name__).lower()
            raise fail(
                "explorer-build",
                f"the compiled explorer cannot be run: {reason}",
                help="if programs in the cache or in TMPDIR may not be executed, name other "
                "folders in XDG_CACHE_HOME and TMPDIR; or use `--engine python`",
            ) from error

    def _read(self, record: Mapping[str, Any]) -> Exploration:
        livelock = record["livelock"]
        return Exploration(
            engine="c",
            end=End(record["outcome"]),
            why=record["why"],
            states=record["states"],
            transitions=record["transitions"],
            depth=record["depth"],
            bytes=record["bytes"],
            seconds=record["seconds"],
            marks=tuple(
                Mark(m["mark"], m["count"], tuple(m["path"]), is_longer=m.get("longer", False))
                for m in record["marks"]
            ),
            livelock_known=record["livelock_known"],
            livelock=None
            if livelock is None
            else (
                (*livelock["path"], AT_ONCE, *livelock["lead"])
                if self._closed.zones
                else tuple(livelock["path"]),
                tuple(livelock["cycle"]),
            ),
            traps_known=record["traps_known"],
            traps=tuple(map(tuple, record["traps"])),
            machines=tuple(
                Figures(
                    figures["locals"],
                    figures["queue"],
                    figures["timers"],
                    figures["microsteps"],
                    frozenset(n for n, seen in enumerate(figures["states"]) if seen == "1"),
                    frozenset(n for n, seen in enumerate(figures["transitions"]) if seen == "1"),
                    read_spread(figures.get("spread")),
                    tuple(map(bytes.fromhex, figures.get("saved", ()))),
                )
                for figures in record["machines"]
            )
            or IDLE * len(self._closed.system.machines),
            cores=record.get("cores", 1),
            zones=record.get("zones", 0),
            doubt=record.get("doubt", "") if self._ranks is None else NEEDS_ONE,
            table=read_table(record.get("table")),
            diagram=read_diagram(record.get("search")),
            traffic=read_traffic(record.get("ranks")),
            temporal=tuple(
                self.answer(number, answer)
                for number, answer in zip(self._decidable, record.get("temporal", ()), strict=False)
            ),
        )

    def answer(self, number: int, record: Mapping[str, Any]) -> Answer:
        """Parse the program's answer to such an option."""
        return Answer(
            number,
            record["known"],
            record["violated"],
            tuple(record["path"]),
            tuple(record["cycle"]),
            record["greatest"] * (self._closed.unit or 1) if "greatest" in record else None,
            record.get("why", "") or why_unknown(record),
            is_longer=record.get("longer", False),
        )

    # --- replay --------------------------------------------------------------------------------

    def _replay(self, path: tuple[int, ...]) -> list[tuple[Step, tuple[str, ...]]]:
        """Return the steps of a path, and the trace of the machines in each."""
        steps, points = with_points(path)
        written = ",".join("!" if step == AT_ONCE else str(step) for step in steps)
        command = [str(self.program), "--replay", written]
        with self._deadline.stage(Stage.REPLAYING):
            done = self._run(command)
        if done.code:
            raise fail(
                "explorer-build",
                f"the explorer cannot replay its own path: {done.err.strip() or done.code}",
                help="please report it",
            )

        def read() -> list[tuple[Step, tuple[str, ...]]]:
            record = list(performed_steps(done.out))
            if self._closed.zones:
                return list(self._with_time(record, points))
            return [(performed.step, lines) for performed, lines in record]

        return self._deadline.cut_off(Stage.REPLAYING, read)

    def _with_time(
        self, record: Sequence[tuple[PerformedStep, tuple[str, ...]]], points: Sequence[Point]
    ) -> Iterator[tuple[Step, tuple[str, ...]]]:
        """Yield steps with the passing of time between them, at their earliest instants."""
        now = Fraction(0)
        steps, end = schedule_path(len(self._closed.charts), [step for step, _ in record], points)
        for (at, step), (_, lines) in zip(steps, record, strict=True):
            if at > now:
                yield Step(Action.ELAPSE, ticks=at - now), ()
                now = at
            yield step, lines
        if end > now:
            yield Step(Action.ELAPSE, ticks=end - now), ()

    def trail(self, path: tuple[int, ...]) -> Trail:
        """Return the steps of a path."""
        steps = [step for step, _ in self._replay(path)]
        first = len(self._closed.charts)
        return (tuple(steps[:first]), *((step,) for step in steps[first:])) if steps else ()

    def _shown(self, machine: int, snapshot: Snapshot) -> Iterator[str]:
        """Yield the program's output for a machine; for a cut array its remaining elements."""
        return explorer_state(self._cut.closed.charts[machine], self._cut.cut(machine, snapshot))

    def confirm(self, found: Counterexample, path: tuple[int, ...]) -> Counterexample:
        """Compare a path in the interpreter with the same path in generated C, line by line."""
        performed = self._replay(path)
        expected = self._deadline.cut_off(
            Stage.REPLAYING, lambda: explorer_output(self._closed, found.steps, self._shown)
        )
        for number, (record, (_, lines)) in enumerate(zip(expected, performed, strict=True), 1):
            checked = tuple(part for line in record for part in line.split("\n"))
            if checked != lines:
                ours, theirs = difference(checked, lines)
                reason = f"in step {number} the interpreter says `{ours}`, generated C `{theirs}`"
                return replace(found, replayed=(), differs=reason)
        return replace(found, replayed=(*found.replayed, "generated C"))
