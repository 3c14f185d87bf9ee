"""fsmkit: statecharts compiled to C and Python, explored exhaustively, from one source.

The verbs of the command line as functions::

    chart = fsmkit.read_chart("feeder.yaml")  # or .scxml
    files = fsmkit.compile(chart, "c")  # contents by path
    report = fsmkit.check("cell.yaml")  # verdicts, figures, counterexamples
    model = fsmkit.export("cell.yaml", "promela")  # for another checker
    picture = fsmkit.draw(chart, "svg")
    session = fsmkit.Session(chart, operations=motor)  # runs it
    fsmkit.live.show(session)  # in a local page (import fsmkit.live)

Each accepts the path of a file or the result of `read`. Errors are an `FsmkitError`, which holds
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
    "ExportedModel",
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
    "ExportedModel": "export.exporter",
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
"""The module of each re-exported name."""


class _PublicAPI(ModuleType):
    """The module: importing the package `fsmkit.export` does not hide the function `export`."""

    def __setattr__(self, name: str, value: object) -> None:
        """Set an attribute, unless the import system would replace `export` by the package."""
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
    """Read a chart, a system or a deployment.

    Args:
        path: A chart in SCXML or YAML, a system or a deployment in YAML, a configuration of the
            library ``transitions`` (``.json``, ``.transitions.yaml``), or ``module:attribute``, a
            machine of that library, whose module is imported.
        replace: Other charts for machines of a system, by path.
        parameters: Values of the parameters of a system, or of the constants of a chart, by name:
            numbers, or strings in the notation of the file.
        strict: Reject what SCXML treats as an error at run time.
        findings: Collects warnings and notes.

    Returns:
        A `Deployment` for a YAML file with the top-level key ``nodes``, a `System` for one with
        ``system``, and a `Chart` for all other files.

    Raises:
        FsmkitError: With every finding, if a file cannot be read or has errors.

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
        path: See `read`.
        parameters: See `read`.
        strict: See `read`.
        findings: See `read`.

    Returns:
        The chart, with inherited parts and the charts that it invokes.

    Raises:
        FsmkitError: See `read`; ``not-a-chart`` for a system or a deployment.

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
    """Read the system to explore; for a deployment, the system that it distributes.

    Args:
        path: See `read`.
        replace: See `read`.
        wires: Files of boards, whose wires restrict external events and their rates.
        parameters: See `read`.
        strict: See `read`.
        findings: See `read`.

    Returns:
        The system. A single chart becomes a system of one machine with all possible external
        events.

    Raises:
        FsmkitError: See `read`; ``not-a-system`` if a machine of a chart is to be replaced.

    """
    from fsmkit.system import any_file

    replacing = {name: Path(file) for name, file in (replace or {}).items()}
    files = [Path(file) for file in wires]
    found = _collection(findings)
    given = _as_texts(parameters)
    return any_file.load_any(path, found, replacing, strict=strict, wires=files, parameters=given)


def compile(  # noqa: A001  (the name of the verb, used as fsmkit.compile)
    subject: Chart | System | Deployment | str | Path,
    target: str = "c",
    *,
    bounds: Literal["from-chart", "from-check"] = "from-chart",
    within: System | str | Path | None = None,
    time: Time = "zones",
    findings: Findings | None = None,
    **options: str,
) -> dict[str, str]:
    """Generate the files of a machine; for a system, all machines in C and the code between them.

    Args:
        subject: The result of `read`, or a path. A deployment becomes a folder for each node.
        target: ``c``, ``python``, ``pyext``, ``javascript``, ``fmu``, ``transitions``, or another
            installed target.
        bounds: The capacities of the chart, or (C) the smallest ones that a check proves
            sufficient.
        within: With ``bounds="from-check"``, the system in which a chart runs; by default it is
            explored alone.
        time: With ``bounds="from-check"``, the time model of that check.
        findings: Collects warnings.
        **options: Options of the target, as on the command line: ``prefix`` of generated names
        (default: the chart's name); ``optimize``, ``without`` (C); ``with`` (C, Python, pyext; as
        ``**{"with": "save"}``); ``trace="on"`` (Python, pyext).

    Returns:
        Contents by relative path.

    Raises:
        FsmkitError: If the target cannot express the subject; ``wrong-option`` for an unknown
            option; ``bounds-not-proved``.

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
    """Explore a chart or a system, and return the verdicts.

    Args:
        subject: The result of `read`, or a path; for a deployment, its system is explored.
        time: ``zones``: dense time. Invoked charts and cyclic schedules need discrete time instead,
            with a note. ``discrete``: time advances by the greatest common divisor of all delays.
            ``untimed``: an armed timer may fire at any time.
        properties: Names of the properties to decide (default: all).
        assume_watchdogs_silent: Transitions marked ``watchdog`` never fire; needs
            ``time="untimed"``.
        engine: ``c``, ``python``, or C if a compiler is available.
        memory: Limit of the exploration in bytes.
        timeout: Limit in seconds (0: none) for the whole call, including reading and all threads.
        workers: Cores to use (0: all); they do not change the results.
        reductions: The reductions to apply; they change no verdict. ``dead``: data that no later
            step reads count as initial. ``sleep``: partial-order reduction by sleep sets.
        storage: ``exact``, or ``hash-compact`` or ``bitstate``, which may miss states, so that
            properties without a counterexample stay undecided.
        search: ``explicit``: states are stored individually. ``symbolic``: states are stored as one
            decision diagram, in discrete time and untimed. ``auto``: explicit, and with millions of
            states also symbolic; the first to end decides.
        order: Names of machines from the top of a decision diagram; by default an order is
            computed.
        max_pending: External-event bound: the number of queued events up to which another external
            event may arrive (0 to 4,294,967,295, which is no limit). None: 1; in a symbolic search
            no limit, unless queues would overflow.
        ranks: MPI processes that explore together, ``fsmkit.Ranks(4)``, on one or several
            computers; needs ``time="discrete"`` or ``"untimed"``.
        findings: Collects warnings and notes.

    Returns:
        The report: ``verdict`` is the worst of all, ``results`` has each with its counterexample,
        ``exploration`` the figures. Properties not decided within memory and time are undecided.

    Raises:
        FsmkitError: If the subject cannot be read or explored; ``no-such-property``,
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
    """Export a chart or a system, closed as for `check`, for another tool.

    Args:
        subject: The result of `read`, or a path; for a deployment, its system is exported.
        notation: ``uppaal``, ``cspm``, ``promela``, ``jani``, ``aut``, ``dot`` or another installed
            notation.
        time: See `check`; other tools do not have fsmkit's zones.
        properties: Names of the properties to export (default: all).
        assume_watchdogs_silent: See `check`.
        most: Maximum number of states.
        timeout: Limit in seconds (0: none).
        findings: Collects warnings and notes.

    Returns:
        The content, and figures by name: ``states``, ``transitions``.

    Raises:
        FsmkitError: If the subject cannot be read, or the notation cannot express it;
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
        subject: The result of `read`, or a path.
        kind: ``svg``, ``png``, ``pdf`` by Graphviz, or a source: ``dot``, ``mmd`` (Mermaid) or
            ``puml`` (PlantUML). The last two are for charts only.
        active: Names of highlighted states of a chart.
        findings: Collects warnings and notes.

    Returns:
        A string, or the bytes of a picture.

    Raises:
        FsmkitError: If the subject cannot be read; ``unknown-suffix`` for another kind,
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
