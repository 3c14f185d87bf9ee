"""Results of other tests: a JUnit XML file, as pytest and many other runners write it.

A case names its requirements by properties: ``<property name="req" value="SAFE-1"/>``. The
plug-in of pytest writes them for tests that are marked with ``@pytest.mark.req("SAFE-1")``.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from fsmkit.chart.loading import read_bytes
from fsmkit.diagnostics import Findings, FsmkitError, Span, Text, fail
from fsmkit.scxml.nodes import Element, decode, read_nodes
from fsmkit.testing.requirements.matrix import CaseResult

SUFFIX = ".xml"
PROPERTY = "req"
FAILED, SKIPPED = ("failure", "error"), "skipped"


def read_results(path: Path) -> tuple[CaseResult, ...]:
    """Return the cases of a file that name requirements; skipped ones are omitted.

    Raises `FsmkitError` (``broken-tests``) for a file that is not JUnit XML.
    """
    findings = Findings()
    source = decode(read_bytes(path), str(path), findings)
    root = None if source is None else read_nodes(source, findings)
    if root is None:
        first = next(iter(findings))
        at = None if first.primary is None else first.primary.span
        raise _broken(f"the results cannot be read: {first.message}", at)
    if root.name not in ("testsuites", "testsuite"):
        raise _broken(f"`<{root.name}>` is not JUnit XML", root.span)
    return tuple(
        CaseResult(str(path), _name(case), case.span, req, not _has(case, *FAILED))
        for case in _cases(root)
        if (req := tuple(_requirements(case))) and not _has(case, SKIPPED)
    )


def _broken(message: str, at: Span | None) -> FsmkitError:
    return fail("broken-tests", message, at, help="write it with `pytest --junitxml results.xml`")


def _cases(root: Element) -> Iterator[Element]:
    """Yield the cases of all suites, in document order."""
    pending = [root]
    while pending:
        element = pending.pop()
        if element.name == "testcase":
            yield element
        else:
            pending += reversed(element.children)


def _requirements(case: Element) -> Iterator[Text]:
    for properties in case.children:
        for each in properties.children if properties.name == "properties" else ():
            name, value = each.get("name"), each.get("value")
            is_id = name is not None and name.value == PROPERTY
            if is_id and value is not None and value.value.strip():
                yield Text(value.value.strip(), value.span)


def _has(case: Element, *names: str) -> bool:
    return any(child.name in names for child in case.children)


def _name(case: Element) -> str:
    """Return the class and the name of a case."""
    parts = (case.get("classname"), case.get("name"))
    return ".".join(part.value for part in parts if part is not None and part.value)
