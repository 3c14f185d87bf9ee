"""The words of the project: a package has no more of the replaced ones than `AT_MOST` says.

Names of definitions, docstrings, comments, messages, help, rule pages and documentation count.
Code in backticks and fenced blocks are quotations, so they do not.

    python tests/architecture/test_words.py               print the number of each package
    python tests/architecture/test_words.py fsmkit/yaml   print each location in this package
"""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = ("fsmkit", "devtools", "machines", "benchmarks", "tests", "docs")
PAGES = ("README.md", "CONTRIBUTING.md")

WORDS = re.compile(
    r"\b(?:told|tells?|telling|ask(?:s|ed|ing)?|hears?|hearing|heard|spel(?:t|l|ls|led|lings?)"
    r"|mend(?:s|ed|ing)?|refus(?:e|es|ed|ing|als?)|beg[iau]n(?:s|ning)?|dear(?:er|est)?|meant|haste"
    r"|patience|(?:left|leav(?:es?|ing)) out|at hand|way there|from outside|f[ae]lls? due|is due"
    r"|(?:is|are) (?-i:none)|of what|by itself|all that|st(?:ands?|ood|anding) (?:in|for))\b",
    re.IGNORECASE,
)
CLAUSE = re.compile(r"(?:What|Whose|Which|That|Who)\b")
FRONTED = re.compile(r"\bOf\s+[a-z_]")
PIECES = re.compile(
    r"t(?:old|ells?|elling)|ask(?:s|ed)?|hears?|heard|spelt|spelling|mend(?:ed)?|refuse[ds]?|beg[iu]ns?"
    r"|meant|haste|patience|who|which|whose|its|ways?|here|each|furthest|unlike|doubt|blaming|passed"
    r"|stepped|ran|made|wanted"
)
NAMES = frozenset({"of", "it", "so"})
FOREACH = re.compile(r"for_?each", re.IGNORECASE)
"""The element of SCXML, which names may contain."""

ALLOWED = {
    r"\bhaste: \d|--haste|--patience": "options: the text around them explains the term",
}
"""Phrases that do not count, and why."""
SKIPPED = {
    Path(__file__).name: "the words themselves",
    "fmi2Functions.h": "text of the FMI standard",
    "fmi2FunctionTypes.h": "text of the FMI standard",
    "fmi3Functions.h": "text of the FMI standard",
    "fmi3FunctionTypes.h": "text of the FMI standard",
}
"""Files that do not count, and why."""

AT_MOST = {
    "CONTRIBUTING.md": 0,
    "README.md": 0,
    "benchmarks": 10,
    "benchmarks/comparison": 12,
    "benchmarks/explorer": 1,
    "benchmarks/latency": 0,
    "benchmarks/overhead": 4,
    "benchmarks/results": 2,
    "benchmarks/ros": 0,
    "benchmarks/yardstick": 0,
    "benchmarks/zones": 1,
    "devtools": 9,
    "devtools/bad_hosts": 1,
    "devtools/editor": 2,
    "devtools/endurance": 20,
    "devtools/fuzz": 4,
    "devtools/random_charts": 6,
    "devtools/site": 0,
    "docs/cookbook": 0,
    "docs/explanation": 1,
    "docs/how-to": 2,
    "docs/reference": 2,
    "fsmkit": 0,
    "fsmkit/carriers": 21,
    "fsmkit/chart": 4,
    "fsmkit/cli": 17,
    "fsmkit/codegen": 10,
    "fsmkit/diagnostics": 0,
    "fsmkit/document": 0,
    "fsmkit/editor": 15,
    "fsmkit/emit": 2,
    "fsmkit/export": 10,
    "fsmkit/foreign": 3,
    "fsmkit/inspector": 68,
    "fsmkit/language": 0,
    "fsmkit/plan": 1,
    "fsmkit/runtime": 25,
    "fsmkit/scxml": 0,
    "fsmkit/system": 7,
    "fsmkit/testing": 6,
    "fsmkit/verify": 42,
    "fsmkit/yaml": 0,
    "machines/csma_cd": 9,
    "machines/fddi": 1,
    "machines/fischer": 1,
    "machines/gantry": 0,
    "machines/heated_mould": 2,
    "machines/moulding_line": 12,
    "machines/philosophers": 2,
    "machines/production_cell": 82,
    "machines/train_gate": 0,
    "tests": 23,
    "tests/architecture": 4,
    "tests/benchmarks": 3,
    "tests/boards": 2,
    "tests/c": 0,
    "tests/carriers": 66,
    "tests/chart": 49,
    "tests/cli": 45,
    "tests/codegen": 66,
    "tests/devtools": 8,
    "tests/diagnostics": 0,
    "tests/differential": 22,
    "tests/docs": 6,
    "tests/document": 1,
    "tests/editor": 18,
    "tests/emit": 0,
    "tests/export": 45,
    "tests/foreign": 40,
    "tests/hostile": 8,
    "tests/injection": 65,
    "tests/inspector": 58,
    "tests/language": 7,
    "tests/machines": 28,
    "tests/misuse": 9,
    "tests/plan": 0,
    "tests/runtime": 33,
    "tests/scxml": 3,
    "tests/system": 19,
    "tests/testing": 13,
    "tests/verify": 124,
    "tests/yaml": 5,
}
"""How many each package may have. Lower a number when you have rewritten; never raise one."""

PIECE = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
QUOTED = re.compile(r"```.*?```|``.*?``|`[^`\n]*`", re.DOTALL)
NOT_COUNTED = re.compile("|".join(ALLOWED))
COMMENT_OF_C = re.compile(r"/\*.*?\*/|(?<!:)//[^\n]*", re.DOTALL)
C_LIKE = {".c", ".h", ".js", ".mjs", ".mts"}


def package_of(file: Path) -> str:
    """Return the entry of `AT_MOST` that a file belongs to: its folder, two levels deep."""
    parts = file.relative_to(ROOT).parts
    return "/".join(parts[: min(2, len(parts) - 1)]) or parts[0]


def read_files() -> Iterator[tuple[Path, str]]:
    """Yield each file that counts, with its text."""
    yield from ((ROOT / name, (ROOT / name).read_text(encoding="utf-8")) for name in PAGES)
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in {".py", ".md", *C_LIKE} and path.name not in SKIPPED:
                yield path, path.read_text(encoding="utf-8")


def words_in_text(text: str) -> Iterator[tuple[int, str]]:
    """Yield each replaced word or phrase in prose, after the number of lines above it."""
    for pattern in (QUOTED, NOT_COUNTED):
        text = pattern.sub(lambda match: re.sub(r"[^\n]", "_", match[0]), text)
    for pattern in (WORDS, FRONTED):
        for match in pattern.finditer(text):
            yield text.count("\n", 0, match.start()), match[0].strip()


def words_in_c(text: str) -> Iterator[tuple[int, str]]:
    """Yield (line, word) for the comments of C or JavaScript."""
    for comment in COMMENT_OF_C.finditer(text):
        first = text.count("\n", 0, comment.start())
        yield from ((first + line, word) for line, word in words_in_text(comment[0]))


def words_in_name(name: str) -> Iterator[str]:
    """Yield the name if a piece of it is a replaced word."""
    pieces = {piece.lower() for piece in PIECE.findall(FOREACH.sub("", name))}
    if name in NAMES or any(map(PIECES.fullmatch, pieces)):
        yield name


def words_in_python(text: str) -> Iterator[tuple[int, str]]:
    """Yield (line, word) for the docstrings, messages, comments and defined names of a module."""
    sentences: set[ast.expr] = set()
    for node in ast.walk(ast.parse(text)):
        match node:
            case ast.Expr(ast.Constant(str() as doc) as constant):
                sentences.add(constant)
                first = constant.lineno - 1
                yield from ((first + line, word) for line, word in words_in_text(doc))
                if CLAUSE.match(doc):
                    yield first, doc.split("\n")[0]
            case ast.Constant(str() as message) if node not in sentences and " " in message:
                first = node.lineno - 1
                yield from ((first + line, word) for line, word in words_in_text(message))
            case ast.FunctionDef() | ast.AsyncFunctionDef() if not node.name.startswith("test_"):
                names = [node.name, *(a.arg for a in ast.walk(node.args) if isinstance(a, ast.arg))]
                yield from ((node.lineno - 1, w) for name in names for w in words_in_name(name))
            case ast.ClassDef(name) | ast.AnnAssign(ast.Name(name)):
                yield from ((node.lineno - 1, word) for word in words_in_name(name))
    if not any("#" in line and WORDS.search(line) for line in text.splitlines()):
        return  # the tokenizer costs more than all above
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            yield from ((token.start[0] - 1, word) for _, word in words_in_text(token.string))


def words_in_file(path: Path, text: str) -> list[tuple[int, str]]:
    """Return (line, word) for all replaced words of a file and of its name."""
    if path.suffix == ".py":
        found = list(words_in_python(text))
    else:
        found = list(words_in_c(text) if path.suffix in C_LIKE else words_in_text(text))
    names = [] if path.name.startswith("test_") or path.suffix == ".md" else [path.stem]
    return [*((0, word) for name in names for word in words_in_name(name)), *found]


def words_by_package() -> dict[str, list[str]]:
    """Return ``file:line: word`` for each replaced word, by package."""
    found = defaultdict[str, list[str]](list)
    for path, text in read_files():
        own = found[package_of(path)]
        name = path.relative_to(ROOT).as_posix()
        own += (f"{name}:{line + 1}: {word}" for line, word in words_in_file(path, text))
    return found


@pytest.mark.slow
def test_packages_use_the_words_of_the_field() -> None:
    counts = {name: len(found) for name, found in words_by_package().items()}
    more = {name: n for name, n in counts.items() if n > AT_MOST.get(name, 0)}
    assert more == {}, "replaced words; the docstring of this module shows how to list them"


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ('"""What is told."""\ndef f(who): ...', 3),
        ('x = "a guard is refused"  # nobody asked', 2),
        ('x: int\n"""Of charts, all."""\nclass Meant: ...', 2),
        ('"""Report `told` and ``asked``."""\ntold = "tell"  # None is None', 0),
    ],
)
def test_replaced_words_are_found_in_python(text: str, count: int) -> None:
    assert len(words_in_file(Path("module.py"), text)) == count


@pytest.mark.parametrize(
    ("file", "text", "count"),
    [
        ("page.md", "Of charts it tells all.\n\n```\ntold\n```\n\nOf `x` and of none.", 3),
        ("file.c", 'char *told = "asked"; /* Of machines\n * begin */ // heard', 3),
        ("told.h", "int a;", 1),
    ],
)
def test_replaced_words_are_found_in_pages_and_c(file: str, text: str, count: int) -> None:
    assert len(words_in_file(Path(file), text)) == count


if __name__ == "__main__":
    packages = words_by_package()
    lines = [line for package in sys.argv[1:] for line in packages[package]]
    counts = [f'    "{name}": {len(own)},' for name, own in sorted(packages.items())]
    sys.stdout.write("\n".join([*(lines or counts), ""]))
