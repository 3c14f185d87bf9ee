"""The layers of docs/explanation/architecture.md: imports point down; no room is crowded."""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "fsmkit"
CODE = {".py", ".c", ".h"}
MOST_FILES = 30
API = {"fsmkit"}
"""The public API stands on everything; importing it for its version is no arrow."""


def layers() -> dict[str, int]:
    """Read the table ``| layer | packages |`` of the architecture page, lowest layer first."""
    found: dict[str, int] = {}
    page = (ROOT / "docs/explanation/architecture.md").read_text(encoding="utf-8")
    for line in page.splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if len(cells) >= 2 and cells[0].isdigit():
            for name in cells[1].split():
                assert name.strip("`") not in found, f"{name} has two layers"
                found[name.strip("`")] = int(cells[0])
    return found


LAYERS = layers()


def package_of(module: str) -> str:
    """Return the entry of the table that a module belongs to: the longest name that fits."""
    parts = module.removeprefix("fsmkit.").split(".")
    names = (".".join(parts[:length]) for length in range(len(parts), 0, -1))
    return next((name for name in names if name in LAYERS), module)


def imported(path: Path) -> Iterator[str]:
    """Yield all that a module imports of fsmkit, in functions and for type checkers, too."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (a.name for a in node.names if a.name.split(".")[0] == "fsmkit")
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            if node.module is not None and node.module.split(".")[0] == "fsmkit":
                yield from (f"{node.module}.{a.name}" for a in node.names)


def arrows() -> Iterator[tuple[str, str, str]]:
    """Yield (module, its package, package it imports), packages on their own left out."""
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        module = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        if module in API:
            continue
        own = package_of(module)
        for name in imported(path):
            if name not in API and name != "fsmkit.__version__" and package_of(name) != own:
                yield module, own, package_of(name)


@pytest.mark.slow
def test_imports_point_down_only() -> None:
    seen = list(arrows())
    unknown = {name for _, own, other in seen for name in (own, other) if name not in LAYERS}
    assert not unknown, "no layer in docs/explanation/architecture.md"
    assert [arrow for arrow in seen if LAYERS[arrow[2]] >= LAYERS[arrow[1]]] == []
    entries = {package_of(name) for arrow in seen for name in arrow[1:]}
    assert set(LAYERS) - entries == set(), (
        "in the table, and imports nothing and is imported by none"
    )


WITHIN_ROOMS = {
    "runtime.interpreter": ["chart.analysis", "plan"],
    "chart.analysis": ["chart.checks"],
    "chart.passes": ["chart.checks"],
}
"""What parts of rooms must not import, although layers would allow it."""


@pytest.mark.slow
@pytest.mark.parametrize("part", WITHIN_ROOMS)
def test_parts_of_rooms_keep_apart(part: str) -> None:
    forbidden = tuple(f"fsmkit.{name}." for name in WITHIN_ROOMS[part])
    files = (PACKAGE / part.replace(".", "/")).rglob("*.py")
    assert [n for path in files for n in imported(path) if f"{n}.".startswith(forbidden)] == []


ON_OTHER_TARGETS = {
    "fmu": {"c", "system"},
    "packages": {"c"},
    "pyext": {"c", "python"},
    "system": {"c"},
    "transitions": {"python"},
}
"""Targets that stand on others, by folder of `codegen`."""


def test_targets_import_only_those_they_stand_on() -> None:
    targets = {path.parent.name for path in (PACKAGE / "codegen").rglob("plugin.py")} | {"system"}
    found: dict[str, set[str]] = {}
    for name in targets:
        for path in (PACKAGE / "codegen" / name).rglob("*.py"):
            for module in imported(path):
                other = module.removeprefix("fsmkit.codegen.").split(".")[0]
                if module.startswith("fsmkit.codegen.") and other in targets - {name}:
                    found.setdefault(name, set()).add(other)
    assert found == ON_OTHER_TARGETS


CIRCLES = {
    "runtime.interpreter": "Appendix D itself: content invokes, and what is invoked has content",
}
"""Packages in which files import each other in a circle, and why."""


@pytest.mark.slow
def test_files_import_each_other_in_no_circle() -> None:
    """But for those of `CIRCLES`; imports inside functions and for type checkers count, too."""
    modules = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        modules[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    below: dict[str, set[str]] = {}
    for module, path in modules.items():
        names = {next(_modules_above(name, modules), "fsmkit") for name in imported(path)}
        below[module] = names - {module, *API}
    found = {module for module in below if _reaches_itself(module, below)}
    known = {name: {m for m in found if m.startswith(f"fsmkit.{name}")} for name in CIRCLES}
    assert found - set[str]().union(*known.values()) == set()
    assert all(known.values()), "in the table, and in no circle any more"


INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*"([^"]+)"', re.MULTILINE)


def includes_in_c() -> dict[str, set[str]]:
    """Return which modules of C each one includes; ``X.c`` and ``X.h`` are one module."""
    files = [path.relative_to(PACKAGE) for path in sorted(PACKAGE.rglob("*.[ch]"))]
    below = {path.with_suffix("").as_posix(): set[str]() for path in files}
    for path in files:
        text = (PACKAGE / path).read_text(encoding="utf-8")
        for name in INCLUDE.findall(text):
            found = {other for other in files if f"/{other.as_posix()}".endswith(f"/{name}")}
            near = path.parent / name  # the compiler looks there first
            for other in {near} if near in found else found:
                below[path.with_suffix("").as_posix()].add(other.with_suffix("").as_posix())
    return {module: others - {module} for module, others in below.items()}


def test_modules_of_c_include_each_other_in_no_circle() -> None:
    below = includes_in_c()
    assert {f"verify/core/{name}" for name in ("search/layer", "store/room")} <= below[
        "verify/core/search/search"
    ]
    assert "runtime/c/links/fsm_link" in below["carriers/zeromq/c/fsm_link_zmq"]
    assert {module for module in below if _reaches_itself(module, below)} == set()


def _modules_above(name: str, modules: Mapping[str, Path]) -> Iterator[str]:
    parts = name.split(".")
    names = (".".join(parts[:length]) for length in range(len(parts), 0, -1))
    return (each for each in names if each in modules)


def _reaches_itself(module: str, below: Mapping[str, set[str]]) -> bool:
    seen, left = set[str](), [module]
    while left:
        new = below[left.pop()] - seen
        if module in new:
            return True
        seen |= new
        left += new
    return False


def test_no_room_is_crowded() -> None:
    folders = [PACKAGE, *(ROOT / name for name in ("devtools", "tests", "benchmarks", "machines"))]
    files = (path for folder in folders for path in folder.rglob("*") if path.suffix in CODE)
    count = Counter(path.parent.relative_to(ROOT).as_posix() for path in files)
    assert {name: number for name, number in count.items() if number > MOST_FILES} == {}
