"""The plug-in of pytest: collects ``*.test.yaml``, provides fixtures, counts coverage.

Every run of pytest imports it through an entry point where fsmkit is installed. It therefore
imports the implementation only for the first test file, fixture or option that needs it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from fsmkit.runtime.session import Session
    from fsmkit.testing.coverage.record import ChartCoverage, Recorder
    from fsmkit.testing.runtimes import Counted
    from fsmkit.testing.suite import Case, Suite

SUFFIXES = (".test.yaml", ".test.yml")
FOLDER = ".fsmkit-coverage"
"""As `reading` and `coverage.record` have them, whose import would be one of all of fsmkit."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options."""
    group = parser.getgroup("fsmkit", "coverage of statecharts")
    group.addoption("--fsmkit-cov", action="store_true", help="Count the coverage of charts.")
    group.addoption(
        "--fsmkit-cov-append", action="store_true", help="Add to the counts that are there."
    )
    group.addoption(
        "--fsmkit-cov-folder", default=FOLDER, metavar="FOLDER", help="Folder of the counts."
    )
    group.addoption(
        "--fsmkit-cov-fail-under",
        type=float,
        metavar="PERCENT",
        help="Fail if less is covered.",
    )
    group.addoption(
        "--fsmkit-target",
        default="interpreter",
        choices=("interpreter", "python", "c"),
        help="Target that runs the cases of *.test.yaml beside the interpreter.",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Declare the marker; start counting if requested: the first process removes old counts."""
    config.addinivalue_line("markers", "req(*ids): the requirements that the test verifies.")
    config.stash[_RECORDER] = None
    if not config.getoption("--fsmkit-cov"):
        return
    from fsmkit.testing.coverage.record import Recorder, erase

    if not _is_worker(config) and not config.getoption("--fsmkit-cov-append"):
        erase(_folder(config))
    config.stash[_RECORDER] = Recorder()


def pytest_itemcollected(item: pytest.Item) -> None:
    """Give the requirements of a test to reports, such as that of ``--junitxml``."""
    ids = [id_ for mark in item.iter_markers("req") for id_ in mark.args]
    if isinstance(item, CaseItem):
        ids += [text.value for text in item.case.req]
    item.user_properties += [("req", str(id_)) for id_ in dict.fromkeys(ids)]


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Collect files of tests."""
    if not file_path.name.endswith(SUFFIXES):
        return None
    return SuiteFile.from_parent(parent, path=file_path)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Keep the counts of this process; fail if all of them together are too little."""
    config = session.config
    recorder = config.stash.get(_RECORDER, None)
    if recorder is None:
        return
    from fsmkit.testing.coverage.record import add_coverage, save

    counted = config.stash.get(_COUNTED, [])
    save(add_coverage((recorder.coverage(), counted)), _folder(config))
    least = config.getoption("--fsmkit-cov-fail-under")
    if least is None or _is_worker(config):
        return
    if _percent(config) < least and session.exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Print a line for each chart."""
    if config.stash.get(_RECORDER, None) is None:
        return
    from fsmkit.testing.coverage.record import load
    from fsmkit.testing.coverage.reports import figures, total

    charts = [chart for chart in load(_folder(config)) if chart.states]
    terminalreporter.section("coverage of charts")
    rows = [(chart.name, figures(chart)) for chart in charts]
    width = max((len(name) for name, _ in rows), default=0)
    for name, row in rows:
        terminalreporter.write_line(
            f"{name:{width}}  states {row.states.covered}/{row.states.all}"
            f"  transitions {row.transitions.covered}/{row.transitions.all}"
            f"  decisions {row.decisions.covered}/{row.decisions.all}"
            f"  MC/DC {row.conditions.covered}/{row.conditions.all}"
            f"  {row.whole.percent:.1f} %"
        )
    least, percent = config.getoption("--fsmkit-cov-fail-under"), total(charts).whole.percent
    terminalreporter.write_line(f"all: {percent:.1f} %")
    if least is not None and percent < least:
        terminalreporter.write_line(
            f"FAILED: {percent:.1f} % of charts are covered, less than {least:g} %", red=True
        )


_RECORDER: pytest.StashKey[Recorder | None] = pytest.StashKey()
_COUNTED: pytest.StashKey[list[ChartCoverage]] = pytest.StashKey()
"""Counts of generated code."""


def _is_worker(config: pytest.Config) -> bool:
    """Whether this is a process that pytest-xdist started."""
    return hasattr(config, "workerinput")


def _folder(config: pytest.Config) -> Path:
    return config.rootpath / str(config.getoption("--fsmkit-cov-folder"))


def _percent(config: pytest.Config) -> float:
    from fsmkit.testing.coverage.record import load
    from fsmkit.testing.coverage.reports import total

    return total(load(_folder(config))).whole.percent


# --- files of tests -----------------------------------------------------------------------------


class SuiteFile(pytest.File):
    """A ``*.test.yaml``."""

    def collect(self) -> Iterator[pytest.Item]:
        """Yield its cases; a file that cannot be read is an error of collecting."""
        from fsmkit.diagnostics import Findings, FsmkitError
        from fsmkit.testing.reading import read_suite

        try:
            suite = read_suite(self.path, Findings())
        except FsmkitError as error:
            raise self.CollectError(str(error)) from error
        recorder = self.config.stash.get(_RECORDER, None)
        if recorder is not None:
            for machine in suite.system.machines:
                recorder.add(machine.chart)
        for case in suite.cases:
            yield CaseItem.from_parent(self, name=str(case.name.value), suite=suite, case=case)


class CaseItem(pytest.Item):
    """A case of a ``*.test.yaml``."""

    def __init__(self, *, suite: Suite, case: Case, **more: Any) -> None:
        super().__init__(**more)
        self.suite, self.case = suite, case

    def runtest(self) -> None:
        """Run the case."""
        from fsmkit.testing.running import run_case
        from fsmkit.testing.runtimes import coverage_of_machines, runtime

        target = self.config.getoption("--fsmkit-target")
        recorder = self.config.stash.get(_RECORDER, None)
        machines: list[Counted] | None = None if recorder is None else []
        if target == "interpreter":
            outcome = run_case(self.suite, self.case, recorder=recorder)
        else:
            outcome = run_case(self.suite, self.case, runtime=runtime(target, machines))
        self.config.stash.setdefault(_COUNTED, []).extend(coverage_of_machines(machines or ()))
        if outcome.failures:
            from fsmkit.testing.outcome_text import failure_text

            raise _FailedCase(failure_text(self.suite, outcome))

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """Return the failure without a Python traceback."""
        from fsmkit.diagnostics import FsmkitError

        if isinstance(excinfo.value, _FailedCase | FsmkitError):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int, str]:
        """Return the line of the case."""
        span = self.case.name.span
        line = span.source.position(span.start)[0]
        return self.path, line - 1, f"{self.suite.name}: {self.name}"


class _FailedCase(Exception):  # noqa: N818  (it never leaves pytest)
    """A failed case; the text describes the failure."""


# --- fixtures -----------------------------------------------------------------------------------


@pytest.fixture
def machine(request: pytest.FixtureRequest) -> Callable[..., Session]:
    """Return a function that creates a `fsmkit.Session` of a chart, on a simulated clock.

    ``machine("gate.yaml")``: the path is relative to the file of the test. Missing operations
    return the first value of their ``from`` list, else the minimum of their type. Other arguments
    are those of `fsmkit.Session`.
    """
    from fsmkit.testing.machines import make_machine

    recorder = request.config.stash.get(_RECORDER, None)
    folder = request.path.parent

    def make(path: str | Path, operations: object = None, **more: Any) -> Session:
        return make_machine(folder / path, operations, recorder, **more)

    return make
