"""Read a path as a Chart, a System or a Deployment. The outermost keys of the file decide.

Most files are charts. The readers of systems, deployments and boards are therefore imported only
when a file needs them: that takes as long as the other imports of `fsmkit compile` together.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, TypeAlias

from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import elaborated, read_bytes, read_documents
from fsmkit.diagnostics import Findings, FsmkitError, Source, fail
from fsmkit.document.document import Document
from fsmkit.document.front_ends import Reader
from fsmkit.document.keys import CHART
from fsmkit.document.python_objects import is_reference
from fsmkit.plugins import plugin_for
from fsmkit.system.board import Board, BoardKind, board_kinds, with_boards
from fsmkit.system.of_one_chart import system_of
from fsmkit.system.parameters import with_set_constants
from fsmkit.system.system import System
from fsmkit.yaml.nodes import Mapping as Entries
from fsmkit.yaml.nodes import Scalar, read_nodes
from fsmkit.yaml.reader import document_of

if TYPE_CHECKING:
    from fsmkit.system.deployment.deployment import Deployment
    from fsmkit.system.machines import Replacement

Model: TypeAlias = "Chart | System | Deployment"
BINDING = CHART["binding"]
"""The key of a chart."""
NONE: Mapping[str, str] = MappingProxyType({})


def read(
    path: str | Path,
    findings: Findings,
    replacing: Mapping[str, Replacement] | None = None,
    *,
    strict: bool = False,
    parameters: Mapping[str, str] = NONE,
) -> Model:
    """Return the chart, the system or the deployment in a file.

    A YAML file with an outermost key ``nodes`` is a deployment, one with ``system`` a system; all
    others are charts.

    Args:
        path: The file, or ``module:attribute`` for a machine of a Python library.
        findings: Receives the warnings.
        replacing: Charts that machines of a system run instead of those named in the file.
        strict: Report SCXML's run-time errors as errors of the file.
        parameters: Values of system parameters, or of constants of a chart, as strings.

    Raises:
        FsmkitError: With all findings, if the file cannot be read; ``not-a-system`` if
            ``replacing`` is given for a chart, or if the file describes a board's wires.

    """
    found = read_sources(
        Path(path), findings, replacing or {}, strict=strict, parameters=parameters
    )
    return _chart(found, findings, strict=strict) if isinstance(found, tuple) else found


def read_with_boards(
    path: str | Path,
    findings: Findings,
    replacing: Mapping[str, Replacement] | None = None,
    *,
    strict: bool = False,
    parameters: Mapping[str, str] = NONE,
) -> Model | Board:
    """Return the result of `read`; for a file with an outermost key ``board``, its wires."""
    found = _content(Path(path), findings, replacing or {}, strict=strict, parameters=parameters)
    return _chart(found, findings, strict=strict) if isinstance(found, tuple) else found


def _chart(documents: tuple[Document, ...], findings: Findings, *, strict: bool) -> Chart:
    """Build a chart, and check its own properties and environment, too. Raises `FsmkitError`."""
    chart = elaborated(documents, findings, strict=strict)
    if chart.properties or chart.environment is not None:
        from fsmkit.system.of_one_chart import system_of_chart

        system_of_chart(chart, findings)
    return chart


def read_sources(
    path: Path,
    findings: Findings,
    replacing: Mapping[str, Replacement],
    *,
    strict: bool = False,
    parameters: Mapping[str, str] = NONE,
) -> tuple[Document, ...] | System | Deployment:
    """Return the result of `read`, but for a chart its documents: its own, then its bases."""
    found = _content(path, findings, replacing, strict=strict, parameters=parameters)
    if isinstance(found, tuple | System):
        return found
    if isinstance(found, Board):
        raise fail(
            "not-a-chart",
            f"`{path}` holds the wires of the board `{found.name}`",
            help="name its deployment; `fsmkit compile` and `fsmkit check` take wires, too",
        )
    return found


def _content(
    path: Path,
    findings: Findings,
    replacing: Mapping[str, Replacement],
    *,
    strict: bool,
    parameters: Mapping[str, str],
) -> tuple[Document, ...] | System | Deployment | Board:
    reader = None if is_reference(str(path)) else plugin_for(Reader, path)
    if reader is None or reader.name != "yaml":
        _require_machines(path, replacing)
        return with_set_constants(read_documents(path, findings), parameters, findings)
    source = reader.decode(read_bytes(path), str(path), findings)
    findings.stop_on_errors()
    root = None if source is None else read_nodes(source, findings)
    keys = {key.value for key, _ in root.entries} if isinstance(root, Entries) else set()
    if "tests" in keys and "cases" in keys:
        raise fail("not-a-chart", f"`{path}` holds tests", help=f"run `fsmkit test {path}`")
    if isinstance(root, Entries) and _is_of_host(root):
        raise fail(
            "not-a-chart", f"`{path}` binds a chart to C",
            help="name the chart; `fsmkit check` takes bindings, too",
        )  # fmt: skip
    found: System | Deployment | Board | Document | None
    if root is None:
        found = None
    elif (kind := _board_kind(keys)) is not None:
        found = kind.read_board(root, path.parent, findings, replacing, strict=strict)
    elif "nodes" in keys:
        from fsmkit.system.deployment.deployment import deployment_of

        found = deployment_of(
            root, path.parent, findings, replacing, strict=strict, parameters=parameters
        )
    elif "system" in keys:
        from fsmkit.system.system_file import system_of_root

        found = system_of_root(
            root, path.parent, findings, replacing, strict=strict, parameters=parameters
        )
    else:
        found = document_of(root, findings)
    findings.stop_on_errors()
    if found is None:
        raise FsmkitError(findings)
    if not isinstance(found, Document):
        return found
    _require_machines(path, replacing)
    documents = read_documents(path, findings, first=found)
    return with_set_constants(documents, parameters, findings)


def _board_kind(keys: Collection[str]) -> BoardKind | None:
    """Return the kind of board with an outermost key in ``keys``, or None."""
    return next((kind for key, kind in board_kinds().items() if key in keys), None)


def _is_of_host(root: Entries) -> bool:
    """Whether a file binds a chart to C. A chart in SCXML may have ``binding: late``, too."""
    values = {key.value: value for key, value in root.entries}
    binding = values.get("binding")
    if not isinstance(binding, Scalar) or "states" in values:
        return False
    return binding.text.value.strip() not in BINDING.choices


def _require_machines(path: Path, replacing: Mapping[str, Replacement]) -> None:
    if replacing:
        raise fail(
            "not-a-system",
            f"`{path}` is one chart: it has no machine to replace",
            help="name a system file",
        )


def read_chart(
    path: str | Path,
    findings: Findings,
    *,
    strict: bool = False,
    parameters: Mapping[str, str] = NONE,
) -> Chart:
    """Return the chart in a file, as `read`. Raises `FsmkitError` (``not-a-chart``) for others."""
    found = read(path, findings, strict=strict, parameters=parameters)
    if not isinstance(found, Chart):
        raise fail(
            "not-a-chart",
            f"`{path}` is a {'system' if isinstance(found, System) else 'deployment'}, not a chart",
            help="name the chart of one of its machines",
        )
    return found


def explored_model(model: Model) -> System:
    """Return the model to explore: for a chart the system of that chart and its environment."""
    if not isinstance(model, Chart):
        return system_within(model)
    from fsmkit.system.of_one_chart import system_of_chart

    return system_of_chart(model)


def system_within(model: Model) -> System:
    """Return a model as a system. A chart becomes one machine with an unrestricted environment."""
    match model:
        case Chart():
            return system_of(model)
        case System():
            return model
        case _:
            return model.written


def sources_of(model: Model | Board) -> tuple[Source, ...]:
    """Return the source texts of a model, without those of invoked charts."""
    match model:
        case Chart():
            return model.sources
        case System():
            own = () if model.source is None else (model.source,)
            charts = (source for machine in model.machines for source in machine.chart.sources)
            return tuple(dict.fromkeys((*own, *charts)))
        case _:
            return () if isinstance(model, Board) else sources_of(model.written)


def load_any(
    path: str | Path,
    findings: Findings,
    replacing: Mapping[str, Replacement] | None = None,
    *,
    strict: bool = False,
    wires: Sequence[Path] = (),
    parameters: Mapping[str, str] = NONE,
) -> System:
    """Return the model that is explored for a file: `explored_model` of the result of `read`.

    ``parameters``: as for `read`. ``wires``: files of boards, whose wires restrict the environment.
    Raises `FsmkitError`: ``not-a-system`` if wires are given for a chart, ``broken-board`` if a
    file of wires is not one.
    """
    model = read(path, findings, replacing, strict=strict, parameters=parameters)
    system = explored_model(model)
    if isinstance(model, Chart) and parameters:
        system = replace(system, parameters=tuple(parameters.items()))
    if not wires:
        return system
    if isinstance(model, Chart):
        raise fail(
            "not-a-system",
            f"`{path}` is one chart: no wires narrow what comes to it",
            help="name the system or the deployment of the board",
        )
    boards = [read_board(file, findings, replacing, strict=strict) for file in wires]
    return replace(with_boards(system, boards), wires=tuple(map(str, wires)))


def read_board(
    path: Path,
    findings: Findings,
    replacing: Mapping[str, Replacement] | None = None,
    *,
    strict: bool = False,
) -> Board:
    """Return the board in a file of wires. Raises `FsmkitError` (``broken-board``) for others."""
    found = read_with_boards(path, findings, replacing, strict=strict)
    if not isinstance(found, Board):
        raise fail(
            "broken-board", f"`{path}` has no key `board`", help="write `board:` and its node"
        )
    return found
