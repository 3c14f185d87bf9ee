"""The engine in C: generate the model, compile it once for each content, run it, read what it says.

The program is built of the machines as `fsmkit compile` writes them, of the adapter, and of
``verify/core``; it is kept in the user's cache under the hash of all its sources.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from fsmkit.diagnostics import Findings, fail
from fsmkit.plugins import Target, plugin
from fsmkit.verify.adapter import MachineAdapter
from fsmkit.verify.adapter_sessions import session_files
from fsmkit.verify.adapter_values import Built, describe, prefix_of
from fsmkit.verify.closed import Closed, with_greatest_delays
from fsmkit.verify.counterexample import Counterexample, as_explored
from fsmkit.verify.exploration import AT_ONCE, Answer, End, Exploration, Figures, Mark, Trail
from fsmkit.verify.instants import Armed, Performed, Point, scheduled, with_points
from fsmkit.verify.moves import Action, Step
from fsmkit.verify.storage import Storage, read_table
from fsmkit.verify.system import PropertyKind, goal_place, temporal_properties
from fsmkit.verify.wiring import system_file

CORE = Path(__file__).parent / "core"
FLAGS = ("-std=gnu99", "-O2", "-pthread", "-fwrapv", "-w", '-DFSM_HOOKS="hooks.h"')
Progress = Callable[[int, int, int], None]


def compiler() -> str | None:
    """Return the path of the C compiler: that of CC, else cc, gcc or clang; None without one."""
    names = [os.environ["CC"]] if os.environ.get("CC") else ["cc", "gcc", "clang"]
    return next((path for name in names if (path := shutil.which(name)) is not None), None)


def model_files(closed: Closed, findings: Findings) -> dict[str, str]:
    """Return the C of a closed system: machines, adapters, wires."""
    target = plugin(Target, "c")
    files: dict[str, str] = {}
    built: list[Built] = []
    for number, chart in enumerate(closed.charts):
        prefix = prefix_of(number, closed.system.machines[number].name)
        own = Findings()
        generated = target.generate(with_greatest_delays(chart), own, {"prefix": prefix})
        findings.extend(d for d in own if generated is None)
        findings.stop_on_errors()
        if generated is None:
            raise fail("explorer-build", f"no C can be generated for `{chart.name}`")
        machine = describe(closed, number, generated.files[f"{prefix}.h"])
        files.update(session_files(closed, machine, generated.files))
        built.append(machine)
        files[f"explore_{number}.c"] = MachineAdapter(closed, machine).text()
    files["explore_system.c"] = system_file(closed, built)
    return files


def cache_folder() -> Path:
    """Return where programs are kept: in XDG_CACHE_HOME, else in ~/.cache."""
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "fsmkit" / "explorer"


class CEngine:
    """A compiled explorer of one closed system."""

    def __init__(self, closed: Closed, findings: Findings) -> None:
        """Generate and compile, or find it in the cache; `FsmkitError` where that fails."""
        self._closed = closed
        self._temporary: tempfile.TemporaryDirectory[str] | None = None
        self.program = self._build(model_files(closed, findings))

    def close(self) -> None:
        """Remove what is not kept in the cache."""
        if self._temporary is not None:
            self._temporary.cleanup()

    # --- building ------------------------------------------------------------------------------

    def _build(self, files: Mapping[str, str]) -> Path:
        command = compiler()
        if command is None:
            raise fail(
                "no-c-compiler",
                "there is no C compiler",
                help="install `cc`, name one in CC, or use `--engine python`",
            )
        core = {path.name: path.read_text() for path in sorted(CORE.glob("*.[ch]"))}
        identity = json.dumps([command, FLAGS, sorted({**core, **files}.items())])
        name = hashlib.sha256(identity.encode()).hexdigest()[:32]
        program = self._folder() / name
        if program.exists():
            return program
        objects = _core_objects(command, core, program.parent)
        with tempfile.TemporaryDirectory(prefix="fsmkit-") as folder:
            headers = {name: text for name, text in core.items() if name.endswith(".h")}
            made = Path(folder) / "explore"
            sources = _write({**headers, **files}, Path(folder))
            _compile(command, [*sources, *map(str, objects), "-o", made.name], Path(folder))
            partial = program.with_suffix(f".{os.getpid()}")
            shutil.copy2(made, partial)
            partial.replace(program)
        return program

    def _folder(self) -> Path:
        folder = cache_folder()
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if os.access(folder, os.W_OK):
                return folder
        except OSError:
            pass
        self._temporary = tempfile.TemporaryDirectory(prefix="fsmkit-")
        return Path(self._temporary.name)

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
    ) -> Exploration:
        """Explore everything, or until some marks were all seen; an interrupt ends it early."""
        command = [str(self.program), "--livelock", "--cores", str(cores)]
        command += ["--memory", str(memory), "--storage", storage.value]
        command += ["--timeout", str(seconds)] if seconds else []
        if until:
            command += ["--until", ",".join(map(str, sorted(until)))]
        command += ["--traps"] * self._closed.is_open + ["--sleepless"] * (not sleeps)
        command += ["--progress"] * (progress is not None)
        command += [] if self._closed.zones else self.temporal_options()
        return self._read(self.result(command, progress))

    @property
    def _decidable(self) -> tuple[int, ...]:
        return temporal_properties(self._closed.system.properties, untimed=self._closed.untimed)

    def temporal_options(self, numbers: Sequence[int] = ()) -> list[str]:
        """Return the options that ask for temporal properties, in their order; none given: all."""
        properties = self._closed.system.properties
        found = ["--timeless"] if self._closed.is_timeless else []
        for number in numbers or self._decidable:
            goal = 1 + goal_place(properties, number)
            if properties[number].kind is PropertyKind.RECOVERABLE:
                found += ["--recoverable", str(1 + number)]
            elif properties[number].kind is PropertyKind.WITHIN:
                units = properties[number].ticks // (self._closed.unit or 1)
                found += ["--within", f"{1 + number},{goal},{units}"]
            else:
                found += ["--leads-to", f"{1 + number},{goal}"]
        return found

    def watch(
        self, begin: int, end: int, most: int, memory: int, seconds: float
    ) -> tuple[Exploration, Mapping[str, Any]]:
        """Explore with a clock that runs from when one property begins to hold until another does.

        In zones only. Also returns what the clock showed (``watch`` in core/timed_main.c); beyond
        ``most`` units it shows only more.
        """
        command = [str(self.program), "--memory", str(memory), "--watch", f"{begin},{end},{most}"]
        if seconds:
            command += ["--timeout", str(seconds)]
        told = self.result(command, None)
        return self._read(told), told["watch"]

    def shown(self) -> frozenset[tuple[str, ...]]:
        """Return all that the machines together ever show: active leaves and data, as in traces.

        In zones only.
        """
        command = [str(self.program), "--list"]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        found: list[list[str]] = []
        for line in done.stdout.splitlines():
            if line.startswith("{"):
                found.append([])
            else:
                found[-1].append(line)
        return frozenset(map(tuple, found[:-1]))

    def result(self, command: list[str], progress: Progress | None) -> Mapping[str, Any]:
        """Return what the program says in the end (``core/main.c``)."""
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None  # noqa: S101  (it is a pipe)
            while True:
                try:
                    for line in process.stdout:
                        told = json.loads(line)
                        if "result" in told:
                            result: Mapping[str, Any] = told["result"]
                            return result
                        _show(told["progress"], progress)
                    break
                except KeyboardInterrupt:
                    process.send_signal(signal.SIGINT)
        raise fail(
            "explorer-build",
            f"the explorer ended with code {process.returncode} and without a result",
            help="use `--engine python`, and please report it",
        )

    def _read(self, told: Mapping[str, Any]) -> Exploration:
        livelock = told["livelock"]
        return Exploration(
            engine="c",
            end=End(told["outcome"]),
            why=told["why"],
            states=told["states"],
            expanded=told["expanded"],
            transitions=told["transitions"],
            depth=told["depth"],
            bytes=told["bytes"],
            seconds=told["seconds"],
            marks=tuple(Mark(m["mark"], m["count"], tuple(m["path"])) for m in told["marks"]),
            livelock_known=told["livelock_known"],
            livelock=None
            if livelock is None
            else (
                (*livelock["path"], AT_ONCE, *livelock["lead"])
                if self._closed.zones
                else tuple(livelock["path"]),
                tuple(livelock["cycle"]),
            ),
            traps_known=told["traps_known"],
            traps=tuple(map(tuple, told["traps"])),
            machines=tuple(
                Figures(
                    figures["locals"],
                    figures["queue"],
                    figures["timers"],
                    figures["microsteps"],
                    frozenset(n for n, seen in enumerate(figures["states"]) if seen == "1"),
                    frozenset(n for n, seen in enumerate(figures["transitions"]) if seen == "1"),
                )
                for figures in told["machines"]
            ),
            cores=told.get("cores", 1),
            parts=told.get("parts", 0),
            doubt=told.get("doubt", ""),
            table=read_table(told.get("table")),
            temporal=tuple(
                self.answer(number, answer)
                for number, answer in zip(self._decidable, told.get("temporal", ()), strict=False)
            ),
        )

    def answer(self, number: int, told: Mapping[str, Any]) -> Answer:
        """Read what the program answers to such an option."""
        return Answer(
            number,
            told["known"],
            told["violated"],
            tuple(told["path"]),
            tuple(told["cycle"]),
            told["greatest"] * (self._closed.unit or 1) if "greatest" in told else None,
            told.get("why", ""),
        )

    # --- replay --------------------------------------------------------------------------------

    def _replayed(self, path: tuple[int, ...]) -> list[tuple[Step, tuple[str, ...]]]:
        """Return the steps of a path, and what the machines did in each."""
        steps, points = with_points(path)
        written = ",".join("!" if step == AT_ONCE else str(step) for step in steps)
        command = [str(self.program), "--replay", written]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise fail(
                "explorer-build",
                f"the explorer cannot replay its own path: {done.stderr.strip()}",
                help="please report it",
            )
        told = list(_steps(done.stdout.splitlines()))
        if self._closed.zones:
            return list(self._with_time(told, points))
        return [(performed.step, lines) for performed, lines in told]

    def _with_time(
        self, told: Sequence[tuple[Performed, tuple[str, ...]]], points: Sequence[Point]
    ) -> Iterator[tuple[Step, tuple[str, ...]]]:
        """Yield steps with the passing of time between them, as early as they can happen."""
        now = Fraction(0)
        steps, end = scheduled(len(self._closed.charts), [step for step, _ in told], points)
        for (at, step), (_, lines) in zip(steps, told, strict=True):
            if at > now:
                yield Step(Action.ELAPSE, ticks=at - now), ()
                now = at
            yield step, lines
        if end > now:
            yield Step(Action.ELAPSE, ticks=end - now), ()

    def trail(self, path: tuple[int, ...]) -> Trail:
        """Return the steps of a path."""
        steps = [step for step, _ in self._replayed(path)]
        first = len(self._closed.charts)
        return (tuple(steps[:first]), *((step,) for step in steps[first:])) if steps else ()

    def confirm(self, found: Counterexample, path: tuple[int, ...]) -> Counterexample:
        """Compare a path in the interpreter with the same in generated C, line by line."""
        performed = self._replayed(path)
        expected = as_explored(self._closed, found.steps)
        for number, (checked, (_, lines)) in enumerate(zip(expected, performed, strict=True), 1):
            if checked != lines:
                ours, theirs = _difference(checked, lines)
                reason = f"in step {number} the interpreter says `{ours}`, generated C `{theirs}`"
                return replace(found, replayed=(), differs=reason)
        return replace(found, replayed=(*found.replayed, "generated C"))


def _core_objects(command: str, core: Mapping[str, str], folder: Path) -> list[Path]:
    """Return the object files of the core, which are the same for all systems."""
    identity = json.dumps([command, FLAGS, sorted(core.items())])
    kept = folder / f"core-{hashlib.sha256(identity.encode()).hexdigest()[:32]}"
    if not kept.exists():
        with tempfile.TemporaryDirectory(prefix="core-", dir=folder) as name:
            made = Path(name) / "made"
            made.mkdir()
            _compile(command, ["-c", *_write(core, made)], made)
            with contextlib.suppress(OSError):  # another process was first
                made.rename(kept)
    return sorted(kept.glob("*.o"))


def _write(files: Mapping[str, str], folder: Path) -> list[str]:
    """Write files, and return the names of those to compile."""
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    return sorted(name for name in files if name.endswith(".c"))


def _compile(command: str, arguments: list[str], folder: Path) -> None:
    done = subprocess.run(
        [command, *FLAGS, "-I.", *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        first = next((line for line in done.stderr.splitlines() if "error" in line), "")
        raise fail(
            "explorer-build",
            f"`{command}` cannot compile the explorer: {first or done.stderr[-300:]}",
            help="use `--engine python`, and please report it",
        )


def _show(told: Mapping[str, int], progress: Progress | None) -> None:
    if progress is not None:
        progress(told["states"], told["transitions"], told["depth"])


def _steps(lines: list[str]) -> Iterator[tuple[Performed, tuple[str, ...]]]:
    step: Performed | None = None
    found: list[str] = []
    for line in lines:
        if not line.startswith("{"):
            found.append(line)
            continue
        told = json.loads(line)
        if "timers" in told and step is not None:
            step = replace(step, timers=tuple(Armed(*timer) for timer in told["timers"]))
            continue
        if step is not None:
            yield step, tuple(found)
        told = told["step"]
        choices = tuple(told["choices"])
        taken = Step(Action(told["action"]), told["machine"], told["argument"], choices)
        step = Performed(taken, told.get("waits", False), ())
        found = []
    if step is not None:
        yield step, tuple(found)


def _difference(ours: tuple[str, ...], theirs: tuple[str, ...]) -> tuple[str, str]:
    """Return the first pair of lines that differ."""
    for n in range(max(len(ours), len(theirs))):
        a = ours[n] if n < len(ours) else "(nothing more)"
        b = theirs[n] if n < len(theirs) else "(nothing more)"
        if a != b:
            return a, b
    return "", ""
