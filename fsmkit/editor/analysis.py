"""Find the diagnostics of the command line in the editor's version of a file."""

from __future__ import annotations

from collections import OrderedDict
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Diagnostic, Findings, FsmkitError, Policy
from fsmkit.diagnostics.allow_comments import record_used
from fsmkit.diagnostics.unused_comments import READING, report_unused_comments
from fsmkit.document.project import Project, project_of, with_levels
from fsmkit.editor.index.files import File, Kind
from fsmkit.editor.index.workspace import Workspace, same

if TYPE_CHECKING:
    from fsmkit.system.board import Board
    from fsmkit.system.deployment.deployment import Deployment
    from fsmkit.system.system import System
    from fsmkit.testing.suite import Suite

    Model = Chart | System | Deployment | Board | Suite
MOST_KEPT = 128


@dataclass(frozen=True, slots=True)
class Analysis:
    """The diagnostics of a file; ``model`` is None if it has an error."""

    path: Path
    findings: tuple[Diagnostic, ...]
    model: Model | None


@dataclass
class Analyses:
    """Analyses of files, each kept until a file changes that it depends on."""

    workspace: Workspace
    _kept: OrderedDict[Path, tuple[tuple[File, ...], Project | None, Analysis]] = field(
        default_factory=OrderedDict
    )
    _charts: dict[Path, Chart] = field(default_factory=dict)

    def analysis(self, path: Path) -> Analysis:
        """Return the analysis of the present content of a file."""
        basis, project = self._basis(path), None
        with suppress(FsmkitError):  # `analyse` reports its errors
            project = project_of(path)
        kept = self._kept.get(path)
        if kept is not None and kept[1] is project and same(kept[0], basis):
            self._kept.move_to_end(path)
            return kept[2]
        found = analyse(self.workspace, path)
        if isinstance(found.model, Chart):
            self._charts[path] = found.model
        self._kept[path] = basis, project, found
        while len(self._kept) > MOST_KEPT:
            gone, _ = self._kept.popitem(last=False)
            self._charts.pop(gone, None)
        return found

    def chart(self, path: Path) -> Chart | None:
        """Return the chart of a file as it last had no error; None where it was not analysed."""
        return self._charts.get(path)

    def _basis(self, path: Path) -> tuple[File, ...]:
        paths = self.workspace.depends_on(path) | {path}
        files = (self.workspace.file(each) for each in sorted(paths))
        return tuple(file for file in files if file is not None)


def analyse(workspace: Workspace, path: Path) -> Analysis:
    """Return the diagnostics that ``check`` or ``test`` reports when it reads a file."""
    # imported here: a server that has just started answers its editor before
    from fsmkit.codegen.existing_c.checks import check_binding
    from fsmkit.codegen.existing_c.reader import chart_of, read_binding
    from fsmkit.system.any_file import read_chart, read_with_boards, sources_of
    from fsmkit.system.deployment.deployment import Deployment
    from fsmkit.system.system import System
    from fsmkit.testing.reading import is_suite, read_suite

    file = workspace.file(path)
    if file is None or file.kind is Kind.OTHER:
        return Analysis(path, (), None)
    findings = Findings()
    model: Model | None = None
    with workspace.unsaved(), record_used() as used:
        try:
            findings = Findings(with_levels(Policy(), project_of(path)))
            if file.kind is Kind.SUITE and is_suite(path):
                model = read_suite(path, findings)
            elif file.kind is Kind.BINDING:
                binding = read_binding(path, findings)
                chart = read_chart(chart_of(binding), findings)
                check_binding(binding, chart, findings)
                findings.stop_on_errors()
            else:
                model = read_with_boards(path, findings)
            if isinstance(model, Chart | System | Deployment):
                report_unused_comments(sources_of(model), used, READING, findings)
        except FsmkitError as error:
            return Analysis(path, error.diagnostics, None)
    return Analysis(path, tuple(findings), model)
