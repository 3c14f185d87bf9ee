"""The floors of docs/explanation/architecture.md, enforced: imports point down only."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "fsmkit"
LONGEST_MODULE = 400


def floors() -> dict[str, int]:
    """Read the table ``| floor | packages |`` of the architecture page."""
    found = {}
    page = (ROOT / "docs/explanation/architecture.md").read_text()
    for line in page.splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if len(cells) >= 2 and cells[0].isdigit():
            found.update({name.strip("`"): int(cells[0]) for name in cells[1].split()})
    return found


FLOORS = floors()
MODULES = sorted(PACKAGE.rglob("*.py"))


def package_of(parts: tuple[str, ...]) -> str:
    """Return the entry of the table a module belongs to: the longest name that fits."""
    for length in range(len(parts), 0, -1):
        if (name := ".".join(parts[:length])) in FLOORS:
            return name
    return parts[0]


def imported(path: Path) -> set[str]:
    found: set[tuple[str, ...]] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {tuple(alias.name.split(".")) for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            module = tuple((node.module or "").split("."))
            found |= {(*module, alias.name) for alias in node.names}
    return {package_of(name[1:]) for name in found if name[0] == "fsmkit" and len(name) > 1}


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_only_what_it_stands_on(path: Path) -> None:
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    if parts[-1] == "__init__" and len(parts) == 1:
        return  # the public API stands on everything
    own = package_of(parts)
    assert own in FLOORS, f"{own} has no floor in the architecture page"
    for other in imported(path) - {own, "__version__"}:
        assert other in FLOORS, f"{path}: imports {other}, which has no floor"
        assert FLOORS[other] < FLOORS[own], f"{path}: {own} must not import {other}"


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_modules_stay_small(path: Path) -> None:
    lines = len(path.read_text().splitlines())
    assert lines <= LONGEST_MODULE, f"{path} has {lines} lines: split it"


@pytest.mark.parametrize(
    "path", [p for p in MODULES if p.name == "__init__.py"], ids=lambda p: str(p.parent.name)
)
def test_no_module_hides_what_its_package_defines(path: Path) -> None:
    """A module, once imported, is an attribute of its package in place of what has its name."""
    modules = {file.stem for file in path.parent.iterdir()}
    body = ast.parse(path.read_text()).body
    assert not modules & {
        node.name for node in body if isinstance(node, ast.FunctionDef | ast.ClassDef)
    }
