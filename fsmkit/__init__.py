"""fsmkit: statecharts compiled to C and Python, explored exhaustively, from one source.

The same as the command line, as functions::

    chart = fsmkit.load("feeder.yaml")                 # or .scxml
    files = fsmkit.compile(chart, "c")                 # texts by path
    report = fsmkit.check("cell.yaml")                 # verdicts, figures, counterexamples
    session = fsmkit.Session(chart, operations=motor)  # runs it

What goes wrong is an `FsmkitError`, which holds the diagnostics. Parts are imported when they are
first used.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from fsmkit.chart.chart import Chart
    from fsmkit.diagnostics import Findings, FsmkitError
    from fsmkit.loading import load
    from fsmkit.runtime.binding import Delivery
    from fsmkit.runtime.clock import Clock, SimulatedClock, WallClock
    from fsmkit.runtime.session import Outcome, Session
    from fsmkit.system.system import System
    from fsmkit.verify.report.verdict import Report, Verdict

__version__ = "0.1.0"
__all__ = [
    "Chart",
    "Delivery",
    "Findings",
    "FsmkitError",
    "Outcome",
    "Report",
    "Session",
    "SimulatedClock",
    "System",
    "Verdict",
    "WallClock",
    "check",
    "compile",
    "load",
    "load_system",
    "machine",
]

Class = TypeVar("Class", bound=type)
HOME_OF = {
    "Chart": "chart.chart",
    "Delivery": "runtime.binding",
    "Findings": "diagnostics",
    "FsmkitError": "diagnostics",
    "Outcome": "runtime.session",
    "Report": "verify.report.verdict",
    "Session": "runtime.session",
    "SimulatedClock": "runtime.clock",
    "System": "system.system",
    "Verdict": "verify.report.verdict",
    "WallClock": "runtime.clock",
    "load": "loading",
}
"""Where each name that is only passed on is defined."""


def __getattr__(name: str) -> Any:
    """Import a name of the public API when it is first asked for."""
    if name not in HOME_OF:
        raise AttributeError(f"module `fsmkit` has no attribute `{name}`")
    found = getattr(import_module(f"fsmkit.{HOME_OF[name]}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    """Return the names of the public API."""
    return sorted({*globals(), *__all__})


def compile(  # noqa: A001  (the name of the verb; nobody imports it bare)
    chart: Chart | str | Path,
    target: str = "c",
    *,
    findings: Findings | None = None,
    **options: str,
) -> dict[str, str]:
    """Return the files of a machine in C or Python, as texts by relative path.

    ``chart``: a chart, or the path of one. ``options`` are the target's, as on the command line:
    ``prefix`` begins the names instead of the chart's. Warnings are left in ``findings``. Raises
    `FsmkitError` where the target cannot express the chart.
    """
    from fsmkit.diagnostics import Findings, FsmkitError
    from fsmkit.loading import load_with_findings
    from fsmkit.plugins import Target, plugin

    found = Findings() if findings is None else findings
    if isinstance(chart, str | Path):
        chart = load_with_findings(chart, found)
    generated = plugin(Target, target).generate(chart, found, options)
    found.stop_on_errors()
    if generated is None:
        raise FsmkitError(found)
    return dict(generated.files)


def load_system(
    path: str | Path,
    *,
    replace: Mapping[str, str | Path] | None = None,
    findings: Findings | None = None,
) -> System:
    """Return the system of a file.

    ``replace``: charts, by path, that machines run instead of those the file names for them.
    Warnings are left in ``findings``. Raises `FsmkitError` with every finding.
    """
    from fsmkit.diagnostics import Findings
    from fsmkit.system.reader import load_system as read

    replacing = {name: Path(file) for name, file in (replace or {}).items()}
    return read(Path(path), Findings() if findings is None else findings, replacing)


def check(
    subject: Chart | System | str | Path,
    *,
    properties: tuple[str, ...] = (),
    untimed: bool = False,
    assume_watchdogs_silent: bool = False,
    zones: bool = True,
    engine: str = "",
    memory: int = 4 << 30,
    timeout: float = 0,
    cores: int = 1,
    no_reduction: tuple[str, ...] = (),
    storage: str = "exact",
    findings: Findings | None = None,
) -> Report:
    """Explore a chart alone, or a system, and return what holds.

    ``subject``: a chart, a system, or the path of either. ``properties``: judge these only (none
    named: all). ``untimed``: an armed timer may fire at any time, and transitions marked
    ``watchdog`` never if ``assume_watchdogs_silent``. ``zones``: time is dense, as far as it can be
    explored so (invoked charts and cyclic schedules cannot, which ``findings`` then tell); else it
    passes by the greatest common divisor of all delays. ``engine``: ``c``, ``python``, or C where
    there is a compiler. ``memory`` in bytes bounds the exploration; ``timeout``, seconds (0: none),
    all that is done here, from reading on and in any thread; where one of them ends it early,
    what was not decided is undecided. ``cores`` (0: all) does not change what is found.
    ``no_reduction``: reductions to switch off, which changes no verdict (``dead``: data that
    nothing can read any more count as at their start; ``sleep``: of steps that do not see each
    other one order is taken). ``storage``: ``exact``, or ``hash-compact`` or ``bitstate``, which
    may miss states: what was not found is then undecided.

    The report's ``verdict`` is the worst of all, ``results`` has each with its counterexample,
    ``exploration`` the figures. Raises `FsmkitError` where the subject cannot be read or explored.
    """
    from fsmkit.chart.chart import Chart
    from fsmkit.diagnostics import Findings
    from fsmkit.system.system import system_of
    from fsmkit.verify.explore import ExplorationOptions, Limits, check_file
    from fsmkit.verify.explore import check as explore
    from fsmkit.verify.statespace.storage import read_storage

    found = Findings() if findings is None else findings
    limits = Limits(memory, timeout, cores)
    options = ExplorationOptions(
        engine,
        untimed=untimed,
        silent=assume_watchdogs_silent,
        limits=limits,
        zones=zones and not untimed,
        without=frozenset(no_reduction),
        storage=read_storage(storage),
    )
    names = frozenset(properties)
    if isinstance(subject, str | Path):
        return check_file(Path(subject), found, options=options, names=names)[1]
    if isinstance(subject, Chart):
        subject = system_of(subject)
    return explore(subject, found, options=options, names=names)


def machine(path: str | Path, clock: Callable[[], Clock] | None = None) -> Callable[[Class], Class]:
    """Return a class decorator that gives each object a running machine, ``self.machine``.

    The object's methods are the operations of the chart; events that leave the machine are told to
    its methods ``on_<event>``. The machine starts when ``__init__`` has returned, on a clock made
    by ``clock`` (simulated unless given). A relative path is looked for in the folder of the file
    that calls this, then in the working directory. Raises `FsmkitError` where the chart cannot be
    read, and, when the class is defined, where an operation has no method.
    """
    from fsmkit.loading import load
    from fsmkit.runtime.clock import SimulatedClock
    from fsmkit.runtime.decorate import bind

    frame = inspect.currentframe()
    caller = frame.f_back if frame is not None else None
    file = caller.f_globals.get("__file__") if caller is not None else None
    beside = Path(file).parent / path if isinstance(file, str) else Path(path)
    return bind(load(beside if beside.exists() else path), clock or SimulatedClock)
