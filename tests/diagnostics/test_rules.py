"""The rules and the source agree: each rule is explained, and used; each finding has a rule."""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import fsmkit
from fsmkit.diagnostics import rules

PACKAGE = Path(fsmkit.__file__).parent
USERS_TARGET = Path(__file__).parents[1] / "codegen/toy_target"
FILES = sorted((PACKAGE / "diagnostics/rules").glob("*.md"))
HEADINGS = ["What it does", "Why it matters", "Example", "Instead"]
RECEIVERS = {"findings", "_findings", "scratch", "attempt"}


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_rule_is_explained(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert re.match(rf"# FK0[1-7]\d\d {re.escape(path.stem)} (error|warning|note)\n\n## ", text)
    outside = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    assert outside.count("```") == 0, "a code block is not closed"
    assert re.findall(r"^## (.*)$", outside, re.MULTILINE) == HEADINGS
    for part in re.split(r"^## .*$", text, flags=re.MULTILINE)[1:]:
        assert part.strip(), "a heading has nothing under it"


def test_codes_are_unique() -> None:
    codes = Counter(rule.code for rule in rules())
    assert [code for code, number in codes.items() if number > 1] == []


@cache
def trees() -> dict[Path, ast.Module]:
    return {
        path: ast.parse(path.read_text(encoding="utf-8")) for path in sorted(PACKAGE.rglob("*.py"))
    }


def named() -> Iterator[tuple[str, str]]:
    """Yield where a finding is added with a literal name, and the name."""
    for path, tree in trees().items():
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and node.args and adds(node.func):
                first = node.args[0]
                if isinstance(first, ast.Constant) and isinstance(first.value, str):
                    yield f"{path.relative_to(PACKAGE)}:{node.lineno}", first.value


def adds(function: ast.expr) -> bool:
    """Whether this is ``fail`` or ``findings.add``."""
    match function:
        case ast.Name(id="fail"):
            return True
        case ast.Attribute(attr="add", value=ast.Name(id=name) | ast.Attribute(attr=name)):
            return name in RECEIVERS
        case _:
            return False


@pytest.mark.slow
def test_every_finding_has_a_rule() -> None:
    known = {rule.name for rule in rules()}
    found = list(named())
    assert len(found) > 100, "the test does not see the findings any more"
    assert [(where, name) for where, name in found if name not in known] == []


@pytest.mark.slow
def test_every_rule_is_used() -> None:
    """Some rules pass through functions before they are used, so any literal counts.

    The target that the documentation builds represents those of users, which have rules too.
    """
    files = [*PACKAGE.rglob("*.py"), *USERS_TARGET.rglob("*.py")]
    text = "\n".join(file.read_text(encoding="utf-8") for file in files)
    assert [rule.name for rule in rules() if f'"{rule.name}"' not in text] == []
