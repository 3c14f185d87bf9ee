"""Pages that are followed to the letter: their files are written, their commands run."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.docs.pages import DOCS, follow_page
from tests.needs import need

EXTERNAL = pytest.mark.external
LESSONS = sorted(path.stem for path in (DOCS / "tutorial").glob("[0-9]*.md"))
COOKBOOK = sorted(path.stem for path in (DOCS / "cookbook").glob("[!R]*.md"))
PAGES = (
    *(pytest.param(f"tutorial/{page}", None, "cc dot") for page in LESSONS),
    pytest.param("../README", 2, "cc"),
    pytest.param("tutorial/existing-driver", 14, "cc cmake libclang", marks=EXTERNAL),
    pytest.param("how-to/existing-c", 10, "cc libclang"),
    pytest.param("how-to/import-python-statemachine", 5, "cc python-statemachine"),
    pytest.param("how-to/any-number", 2, "cc"),
    pytest.param("how-to/import-qm", 6, "cc"),
    pytest.param("how-to/add-a-reader", 5, "cc"),
    pytest.param("how-to/import-rhapsody", 6, "cc"),
    pytest.param("how-to/import-mermaid", 3, "cc"),
    pytest.param("how-to/import-itemis", 4, "cc"),
    pytest.param("how-to/import-statesmith", 4, "cc"),
    pytest.param("how-to/simulate", 2, ""),
    pytest.param("how-to/compare", 2, "dot", marks=EXTERNAL),
    pytest.param("how-to/certify", 4, "cc arm-none-eabi-gcc unicorn", marks=EXTERNAL),
    pytest.param("how-to/state-certificates", 2, "cc node", marks=EXTERNAL),
    pytest.param("reference/javascript", 2, "node", marks=EXTERNAL),
    pytest.param("reference/transitions", 6, ""),
    *(
        pytest.param(f"cookbook/{page}", None, "tree-sitter" if page == "from-xstate" else "")
        for page in COOKBOOK
    ),
)
"""Pages, how many commands each has (None: some), and the tools that it needs."""
MODULES = {
    "libclang": "clang",
    "python-statemachine": "statemachine",
    "tree-sitter": "tree_sitter_typescript",
    "unicorn": "unicorn",
}
"""Tools that are packages of Python, with the module of each."""
QUIET = (
    ("how-to/counterexamples", 10),
    ("how-to/frozen-nodes", 2),
    ("how-to/mutants", 1),
    ("how-to/requirements", 3),
    ("how-to/save-and-replay", 5),
    ("how-to/trace", 4),
)
"""Pages that leave out what is printed on standard error."""


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.usefixtures("of_a_user")
@pytest.mark.parametrize(("page", "commands", "tools"), PAGES)
def test_the_page_does_what_it_says(
    page: str, commands: int | None, tools: str, tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    for tool in tools.split():
        if tool in MODULES:
            need(find_spec(MODULES[tool]) is not None, tool)
        else:
            require_tool(tool)
    count = follow_page(DOCS / f"{page}.md", tmp_path)
    assert count == commands if commands is not None else count


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.usefixtures("of_a_user")
@pytest.mark.parametrize(("page", "commands"), QUIET)
def test_what_the_commands_print(
    page: str, commands: int, tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    require_tool("cc")
    assert follow_page(DOCS / f"{page}.md", tmp_path, with_errors=False) == commands
    if page == "how-to/counterexamples":
        svg = (tmp_path / "garage.svg").read_text(encoding="utf-8")
        assert "violated: never_stuck: never: gate.In(failed)" in svg


def test_the_index_of_the_cookbook_names_each_page() -> None:
    index = (DOCS / "cookbook" / "README.md").read_text(encoding="utf-8")
    assert [page for page in COOKBOOK if f"({page}.md)" not in index] == []
    assert len(COOKBOOK) > 8
