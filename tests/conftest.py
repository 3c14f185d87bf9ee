"""Settings of all tests: their markers, and that each test is what its markers say."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

from fsmkit.emit import written
from tests import documents, helps, needs

documents.check_documents()
written.guards_notations = True
os.environ["FSMKIT_GUARD_NOTATIONS"] = "1"
written.is_strict = "FSMKIT_STRICT_TEXTS" in os.environ  # no raw text, however harmless
# The computer may be slow. What must pass before a change lands draws the same examples each time.
settings.register_profile("fsmkit", deadline=None, derandomize="FSMKIT_REQUIRE_TOOLS" in os.environ)
settings.load_profile("fsmkit")
# Modules, tests and syntax trees live to the end: Python's default searches them for garbage in
# circles thousands of times, a seventh of all processor time.
gc.set_threshold(20_000)

STARTS = frozenset({"subprocess.Popen", "os.fork", "os.posix_spawn", "os.exec"})
"""Audited events of a process that begins."""
started: list[str] = []
"""Programs started since the setup of the current test, which includes its fixtures."""


def _audit(event: str, arguments: tuple[Any, ...]) -> None:
    if event in STARTS:
        command = arguments[1] if event == "subprocess.Popen" else event
        program = command if isinstance(command, str) else str(command[0])
        started.append(Path(program).name)


sys.addaudithook(_audit)


LEFT_OUT = pytest.StashKey[list[str]]()
"""What the summary says of tests that were left out."""


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark tests by their parameters and fixtures; leave out those that cannot run here."""
    for item in items:
        params = getattr(item, "callspec", None)
        values = [] if params is None else params.params.values()
        if needs.EXTERNAL & {value for value in values if isinstance(value, str)}:
            item.add_marker("external")
        if params is not None and params.params.get("engine") == "c":
            item.add_marker("cc")
        if needs.DATA_FIXTURES & set(getattr(item, "fixturenames", ())):
            item.add_marker(needs.where(needs.DATA.is_dir(), needs.NO_DATA))
    left_out = [item for item in items if _unmet(item)]
    if left_out:
        reasons = {str(mark.kwargs["reason"]) for item in left_out for mark in _unmet(item)}
        config.stash[LEFT_OUT] = [f"{len(left_out)} tests left out: {'; '.join(sorted(reasons))}"]
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if not _unmet(item)]
    if "PYTEST_XDIST_WORKER" in os.environ:  # a long test at the end keeps one worker busy alone
        slow = {item.path for item in items if item.get_closest_marker("slow")}
        items.sort(key=lambda item: item.path not in slow)


def pytest_collection_finish() -> None:
    """Search what was collected for garbage no more: it lives until the end."""
    gc.freeze()


def _unmet(item: pytest.Item) -> list[pytest.Mark]:
    return [mark for mark in item.iter_markers("only_where") if not mark.args[0]]


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Count the tests that were left out because of this machine, and say why."""
    for line in config.stash.get(LEFT_OUT, []):
        terminalreporter.write_line(line)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Where all tools must be there, count a skip as a failure, whoever skipped."""
    report = yield
    if report.skipped and not hasattr(report, "wasxfail") and needs.ALL_TOOLS:
        report.outcome = "failed"
    return report


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup() -> None:
    """Forget the programs of the test before."""
    started.clear()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """Where tests are chosen by markers, fail one that starts a program they do not announce."""
    if item.get_closest_marker("cc"):
        needs.need(needs.compiler() is not None, "cc")
    params = getattr(item, "callspec", None)
    if params and any(getattr(v, "name", v) == "javascript" for v in params.params.values()):
        needs.tool("node")
    by_fixtures = len(started)
    yield
    if not item.config.option.markexpr or item.get_closest_marker("external"):
        return
    if external := sorted(needs.EXTERNAL & set(started[by_fixtures:])):
        pytest.fail(f"the test starts {', '.join(external)}: mark it `external`")
    if started and not (item.get_closest_marker("cc") or item.get_closest_marker("slow")):
        pytest.fail(f"the test starts {', '.join(sorted(set(started)))}: mark it `cc`")


@pytest.fixture(scope="session")
def require() -> Callable[[bool, str], None]:
    """Skip the test where a tool is not there, or fail where all tools must be there."""
    return needs.need


@pytest.fixture(scope="session")
def require_tool() -> Callable[[str], str]:
    """Give the path of a tool; without it skip the test, or fail where all tools must be there."""
    return needs.tool


@pytest.fixture(scope="session")
def dot() -> str:
    """Give the path of Graphviz's layout program."""
    return needs.tool("dot")


@pytest.fixture(scope="session", autouse=True)
def followed_helps() -> Iterator[None]:
    """Fail each test that prints a finding whose help names an option that the verb lacks."""
    with pytest.MonkeyPatch.context() as patch:
        helps.watch(patch)
        yield


@pytest.fixture(scope="session")
def cache_of_session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder for explorers that the tests compile; all workers share it."""
    folder = tmp_path_factory.getbasetemp()
    return (folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder) / "cache"


@pytest.fixture(scope="module")
def own_cache(cache_of_session: Path) -> Iterator[None]:
    """Compile each explorer, and the core of all, once for the session, not for the user."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(cache_of_session))
        yield


@pytest.fixture(scope="module")
def quickly_compiled() -> Iterator[None]:
    """Compile explorers quickly, for many that explore little; wants `own_cache`."""
    from fsmkit.verify.engines.c import engine

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engine, "FLAGS", ("-O0", *(f for f in engine.FLAGS if f != "-O2")))
        yield
