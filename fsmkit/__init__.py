"""fsmkit: statecharts compiled to C and Python, explored exhaustively, from one source.

The verbs of the command line as functions::

    chart = fsmkit.read_chart("feeder.yaml")  # or .scxml
    files = fsmkit.compile(chart, "c")  # contents by path
    report = fsmkit.check("cell.yaml")  # verdicts, figures, counterexamples
    model = fsmkit.export("cell.yaml", "promela")  # for another checker
    picture = fsmkit.draw(chart, "svg")
    session = fsmkit.Session(chart, operations=motor)  # runs it
    fsmkit.live.show(session)  # in a page of this machine (import fsmkit.live)

Each takes the path of a file or what `read` made of it. Errors are an `FsmkitError`, which holds
the diagnostics. Parts are imported when they are first used.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Iterable, Mapping
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from fsmkit.emit.version import VERSION

if TYPE_CHECKING:
    from fsmkit.chart.chart import Chart
    from fsmkit.diagnostics import Findings, FsmkitError
    from fsmkit.export.exporter import ExportedModel
    from fsmkit.runtime.clock import Clock, SimulatedClock, WallClock
    from fsmkit.runtime.host_methods import Delivery
    from fsmkit.runtime.node import Node
    from fsmkit.runtime.session import Outcome, Session
    from fsmkit.system.any_file import Model
    from fsmkit.system.deployment.deployment import Deployment
    from fsmkit.system.system import System
    from fsmkit.verify.report.verdict import Report, Verdict
    from fsmkit.verify.resources.time import Time
    from fsmkit.verify.statespace.ranks import Ranks

__version__ = VERSION
__all__ = [
    "Chart",
    "Delivery",
    "Deployment",
    "Exported",
    "Findings",
    "FsmkitError",
    "Node",
    "Outcome",
    "Ranks",
    "Report",
    "Session",
    "SimulatedClock",
    "System",
    "Verdict",
    "WallClock",
    "check",
    "compile",
    "draw",
    "export",
    "machine",
    "read",
    "read_chart",
    "read_system",
]

Class = TypeVar("Class", bound=type)
HOME_OF = {
    "Chart": "chart.chart",
    "Delivery": "runtime.host_methods",
    "Deployment": "system.deployment.deployment",
    "Exported": "export.exporter",
    "Findings": "diagnostics",
    "FsmkitError": "diagnostics",
    "Node": "runtime.node",
    "Outcome": "runtime.session",
    "Ranks": "verify.statespace.ranks",
    "Report": "verify.report.verdict",
    "Session": "runtime.session",
    "SimulatedClock": "runtime.clock",
    "System": "system.system",
    "Verdict": "verify.report.verdict",
    "WallClock": "runtime.clock",
}
"""Where each name that is only passed on is defined."""


class _PublicAPI(ModuleType):
    """The module: importing the package `fsmkit.export` does not hide the function `export`."""

    def __setattr__(self, name: str, value: object) -> None:
        if not (name == "export" and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _PublicAPI


def __getattr__(name: str) -> Any:
    """Import a name of the public API when it is first used."""
    if name not in HOME_OF:
        raise AttributeError(f"module `fsmkit` has no attribute `{name}`")
    found = getattr(import_module(f"fsmkit.{HOME_OF[name]}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    """Return the names of the public API."""
    return sorted({*globals(), *__all__})


def read(
    path: str | Path,
    *,
    replace: Mapping[str, str | Path] | None = None,
    parameters: Mapping[str, object] | None = None,
    strict: bool = False,
    findings: Findings | None = None,
) -> Chart | System | Deployment:
    """Read a file once, and return what it holds.

    Args:
        path: A chart in SCXML or YAML, a system or a deployment in YAML, a configuration of the
            library ``transitions`` (``.json``, ``.transitions.yaml``), or ``module:attribute``, a
            machine of that library, whose module is imported.
        replace: Charts, by path, that machines of a system run instead of those the file names.
        parameters: Values of parameters of a system, or of constants of a chart, by name: numbers,
            or texts as the file has them.
        strict: What SCXML would make an error at run time is an error of the chart.
        findings: Where warnings and notes are left.

    Returns:
        A YAML file with an outermost key ``nodes`` is a `Deployment`, one with ``system`` a
        `System`; all other files are a `Chart`.

    Raises:
        FsmkitError: With every finding, where something cannot be read or is no sound chart.

    """
    from fsmkit.system import any_file

    replacing = {name: Path(file) for name, file in (replace or {}).items()}
    given = _as_texts(parameters)
    return any_file.read(path, _collection(findings), replacing, strict=strict, parameters=given)


def _as_texts(parameters: Mapping[str, object] | None) -> dict[str, str]:
    """Return values as a file has them."""
    return {
        name: str(value).lower() if isinstance(value, bool) else str(value)
        for name, value in (parameters or {}).items()
    }


def read_chart(
    path: str | Path,
    *,
    parameters: Mapping[str, object] | None = None,
    strict: bool = False,
    findings: Findings | None = None,
) -> Chart:
    """Read the chart of a file.

    Args:
        path: As of `read`.
        parameters: As of `read`.
        strict: As of `read`.
        findings: As of `read`.

    Returns:
        The chart, with what it inherits and the charts that it invokes.

    Raises:
        FsmkitError: As of `read`; ``not-a-chart`` for a system or a deployment.

    """
    from fsmkit.system import any_file

    given = _as_texts(parameters)
    return any_file.read_chart(path, _collection(findings), strict=strict, parameters=given)


def read_system(
    path: str | Path,
    *,
    replace: Mapping[str, str | Path] | None = None,
    wires: Iterable[str | Path] = (),
    parameters: Mapping[str, object] | None = None,
    strict: bool = False,
    findings: Findings | None = None,
) -> System:
    """Read what is explored of a file: a system; of a deployment, the system that it spreads.

    Args:
        path: As of `read`.
        replace: As of `read`.
        wires: Files of boards, whose wires narrow what comes from the environment, and how often.
        parameters: As of `read`.
        strict: As of `read`.
        findings: As of `read`.

    Returns:
        The system. A chart alone is one of a single machine, under all that may come.

    Raises:
        FsmkitError: As of `read`; ``not-a-system`` where a machine of a chart is to be replaced.

    """
    from fsmkit.system import any_file

    replacing = {name: Path(file) for name, file in (replace or {}).items()}
    files = [Path(file) for file in wires]
    found = _collection(findings)
    given = _as_texts(parameters)
    return any_file.load_any(path, found, replacing, strict=strict, wires=files, parameters=given)


def compile(  # noqa: A001  (the name of the verb; nobody imports it bare)
    subject: Chart | System | Deployment | str | Path,
    target: str = "c",
    *,
    bounds: Literal["from-chart", "from-check"] = "from-chart",
    within: System | str | Path | None = None,
    time: Time = "zones",
    findings: Findings | None = None,
    **options: str,
) -> dict[str, str]:
    """Make the files of a machine; or of all machines of a system, in C with what connects them.

    Args:
        subject: What `read` returns, or a path. A deployment becomes a folder for each node.
        target: ``c``, ``python``, ``pyext``, ``javascript``, ``fmu``, ``transitions``, or another
            that is installed.
        bounds: The capacities of the chart, or (C) as little as a check proves to be enough.
        within: With ``bounds="from-check"``: the system in which a chart runs; else it is explored
            as it is.
        time: With ``bounds="from-check"``: how time passes in that check.
        findings: Where warnings are left.
        **options: The target's, as on the command line: ``prefix`` begins the names instead of the
            chart's; ``optimize``, ``without`` (C); ``with`` (C, Python, pyext; as ``**{"with":
            "save"}``); ``trace="on"`` (Python, pyext).

    Returns:
        Texts by relative path.

    Raises:
        FsmkitError: Where the target cannot express the subject; ``wrong-option`` for an option
            that it does not have; ``bounds-not-proved``.

    """
    found = _collection(findings)
    model = _model(subject, found)
    if bounds == "from-chart":
        from fsmkit.codegen.system.program import program_of

        files = program_of(model, target, found, options).files
    else:
        from fsmkit.verify.bounds import proved_program

        system = _system(within, found) if within is not None else None
        files = proved_program(model, target, found, options, within=system, time=time).files
    return {path: text for path, text in files.items() if isinstance(text, str)}


def check(
    subject: Chart | System | Deployment | str | Path,
    *,
    time: Time = "zones",
    properties: Collection[str] = (),
    assume_watchdogs_silent: bool = False,
    engine: str = "",
    memory: int = 4 << 30,
    timeout: float = 0,
    workers: int = 1,
    reductions: Collection[str] = ("dead", "sleep"),
    storage: str = "exact",
    search: str = "auto",
    order: Collection[str] = (),
    max_pending: int | None = None,
    ranks: Ranks | None = None,
    findings: Findings | None = None,
) -> Report:
    """Explore a chart alone, or a system, and return the verdicts.

    Args:
        subject: What `read` returns, or a path; of a deployment the system is explored.
        time: ``zones``: time is dense, as far as it can be explored so (invoked charts and cyclic
            schedules cannot: then a note says so, and it is discrete). ``discrete``: it passes by
            the greatest common divisor of all delays. ``untimed``: an armed timer may fire at any
            time.
        properties: Decide these only (none named: all).
        assume_watchdogs_silent: Transitions marked ``watchdog`` never fire; needs
            ``time="untimed"``.
        engine: ``c``, ``python``, or C where there is a compiler.
        memory: Bytes, which bound the exploration.
        timeout: Seconds (0: none) for all that is done here, from reading on and in any thread.
        workers: Cores to use (0: all); they do not change what is found.
        reductions: Those that are applied, which change no verdict. ``dead``: data that nothing can
            read any more count as at their start. ``sleep``: partial-order reduction by sleep sets.
        storage: ``exact``, or ``hash-compact`` or ``bitstate``, which may miss states: what was not
            found is then undecided.
        search: ``explicit``: states are kept one by one. ``symbolic``: as one decision diagram, in
            discrete time and untimed. ``auto``: one by one, and where there are millions also as a
            diagram; the first to end answers.
        order: Names of machines from the top of a diagram on; without them an order is sought.
        max_pending: Events that may be queued when another comes from outside (0 to 4,294,967,295,
            which is no limit). None: 1; in a symbolic search no limit, unless queues overflow so.
        ranks: Processes of MPI that explore together, ``fsmkit.Ranks(4)``, on this machine or on
            several; needs ``time="discrete"`` or ``"untimed"``.
        findings: Where warnings and notes are left.

    Returns:
        The report: ``verdict`` is the worst of all, ``results`` has each with its counterexample,
        ``exploration`` the figures. What was not decided within memory and time is undecided.

    Raises:
        FsmkitError: Where the subject cannot be read or explored; ``no-such-property``,
            ``no-such-reduction``, ``no-such-storage``, ``no-such-search``.

    """
    from fsmkit.verify import explore
    from fsmkit.verify.statespace.storage import read_storage
    from fsmkit.verify.statespace.symbolic_search import read_search

    found = _collection(findings)
    options = explore.ExplorationOptions(
        engine,
        time=time,
        assume_watchdogs_silent=assume_watchdogs_silent,
        memory=memory,
        timeout=timeout,
        workers=workers,
        reductions=frozenset(reductions),
        storage=read_storage(storage),
        search=read_search(search),
        order=tuple(order),
        max_pending=max_pending,
        ranks=ranks,
    )
    names = frozenset(properties)
    if isinstance(subject, str | Path):
        return explore.check_file(Path(subject), found, options=options, properties=names)[1]
    return explore.check(_system(subject, found), found, options=options, properties=names)


def export(
    subject: Chart | System | Deployment | str | Path,
    notation: str,
    *,
    time: Literal["discrete", "untimed"] = "discrete",
    properties: Collection[str] = (),
    assume_watchdogs_silent: bool = False,
    most: int = 1_000_000,
    timeout: float = 0,
    findings: Findings | None = None,
) -> ExportedModel:
    """Write a chart or a system, closed as it is explored, for another tool.

    Args:
        subject: What `read` returns, or a path; of a deployment the system is written.
        notation: ``uppaal``, ``cspm``, ``promela``, ``jani``, ``aut``, ``dot`` or another that is
            installed.
        time: As of `check`; other tools have no zones of ours.
        properties: Carry over these only (none named: all).
        assume_watchdogs_silent: As of `check`.
        most: States; beyond them nothing is written.
        timeout: Seconds (0: none).
        findings: Where warnings and notes are left.

    Returns:
        The text, and figures by name: ``states``, ``transitions``.

    Raises:
        FsmkitError: Where the subject cannot be read, or the notation cannot say it;
            ``export-too-large`` beyond ``most`` and ``timeout``; ``no-such-property``.

    """
    from fsmkit.export.exporter import Exporter, ExportOptions, export_deadline
    from fsmkit.plugins import plugin
    from fsmkit.verify.explore import with_properties
    from fsmkit.verify.resources.deadline import Deadline, Stage

    exporter, deadline = plugin(Exporter, notation), Deadline(timeout)
    found = _collection(findings)
    with export_deadline(deadline):
        with deadline.stage(Stage.READING):
            system = with_properties(_system(subject, found), frozenset(properties))
        silent = assume_watchdogs_silent
        options = ExportOptions(time == "untimed", silent, most, deadline, findings=found)
        with deadline.stage(Stage.EXPLORING):
            return exporter.export(system, options)


def draw(
    subject: Chart | System | Deployment | str | Path,
    kind: str = "svg",
    *,
    active: Iterable[str] = (),
    findings: Findings | None = None,
) -> str | bytes:
    """Draw a chart by its states, or a system by its machines and their connections.

    Args:
        subject: What `read` returns, or a path.
        kind: ``svg``, ``png``, ``pdf``, which Graphviz makes; or a text: ``dot``, ``mmd`` (Mermaid)
            or ``puml`` (PlantUML), the latter two of charts.
        active: Names of states of a chart that stand out.
        findings: Where warnings and notes are left.

    Returns:
        A text, or the bytes of a picture.

    Raises:
        FsmkitError: Where the subject cannot be read; ``unknown-suffix`` for another kind,
            ``unknown-name`` for a state, ``missing-graphviz``.

    """
    from fsmkit.system.views.drawing import draw as drawn
    from fsmkit.system.views.drawing import states_named

    model = _model(subject, _collection(findings))
    return drawn(model, Path(f"drawing.{kind}"), states_named(model, active))


def machine(path: str | Path, clock: Callable[[], Clock] | None = None) -> Callable[[Class], Class]:
    """Return a class decorator that gives each object a running machine, ``self.machine``.

    The object's methods are the operations of the chart; events that leave the machine go to its
    methods ``on_<event>``. The machine starts when ``__init__`` has returned.

    Args:
        path: A chart. A relative path is looked for in the folder of the file that calls this, then
            in the working directory.
        clock: Makes the clock of a machine (simulated unless given).

    Returns:
        The decorator.

    Raises:
        FsmkitError: Where the chart cannot be read; and, when the class is defined, where an
            operation has no method.

    """
    from inspect import currentframe  # it takes most of the time of an import of this package

    from fsmkit.runtime.clock import SimulatedClock
    from fsmkit.runtime.session import bind

    frame = currentframe()
    caller = frame.f_back if frame is not None else None
    file = caller.f_globals.get("__file__") if caller is not None else None
    beside = Path(file).parent / path if isinstance(file, str) else Path(path)
    return bind(read_chart(beside if beside.exists() else path), clock or SimulatedClock)


def _collection(findings: Findings | None) -> Findings:
    from fsmkit.diagnostics import Findings

    return Findings() if findings is None else findings


def _model(subject: Model | str | Path, findings: Findings) -> Model:
    from fsmkit.chart.chart import Chart
    from fsmkit.system.any_file import read
    from fsmkit.system.system import System

    if isinstance(subject, str | Path):
        return read(subject, findings)
    given: object = subject
    if not isinstance(given, Chart | System):
        from fsmkit.system.deployment.deployment import Deployment

        if not isinstance(given, Deployment):
            raise TypeError(
                f"neither a path nor what `fsmkit.read` returns, but a {type(given).__name__}"
            )
    return subject


def _system(subject: Model | str | Path, findings: Findings) -> System:
    from fsmkit.system.any_file import explored_model

    return explored_model(_model(subject, findings))
