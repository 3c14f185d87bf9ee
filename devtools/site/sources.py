"""Collect the sources of the site: the pages of ``docs``, and pages generated from the package.

Pages remain readable in the repository, so a link may lead out of ``docs``: to another page of the
repository, which becomes a page of the site, or to a file or folder, shown as its path.
"""

from __future__ import annotations

import posixpath
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import click

import fsmkit
from fsmkit.cli import cli as verbs
from fsmkit.diagnostics.rules import Severity, rules

ROOT = Path(__file__).parents[2]
SHELVES = {
    "tutorial": "Tutorial",
    "how-to": "How-to guides",
    "cookbook": "Cookbook",
    "reference": "Reference",
    "explanation": "Explanation",
}
"""The folders of ``docs``, in the order of the margin."""
BESIDE = {
    "CHANGELOG.md": "about/changelog.md",
    "CONTRIBUTING.md": "about/contributing.md",
    "machines/production_cell/README.md": "about/production-cell.md",
    "machines/production_cell/boards/README.md": "about/boards.md",
}
"""Pages of the repository that are pages of the site, too."""
LINK = re.compile(r"(?<!!)\[(?P<text>[^\]]*)\]\((?P<to>[^)#\s]+)(?P<part>#[^)\s]*)?\)")
IMAGE = re.compile(r'<img src="([^"]+)"[^>]* alt="([^"]+)">')
WIDTH = 100
"""Columns of the help of verbs."""
GRAMMAR = ROOT / "fsmkit" / "language" / "grammar.lark"
RULES = """Every finding has a rule. `fsmkit explain CODE` prints the page of one. An error stops
the command; warnings and notes can be suppressed with `--allow RULE`, or made errors with
`--error RULE`."""
SEVERITIES = {
    Severity.ERROR: "stops the command",
    Severity.WARNING: "is reported",
    Severity.NOTE: "is reported in passing",
}


def write_sources(folder: Path) -> None:
    """Write all pages, pictures and the configuration of Sphinx into a new folder."""
    for page, text in pages():
        target = folder / page
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text, encoding="utf-8")
    shutil.copytree(ROOT / "docs" / "pictures", folder / "pictures")
    shutil.copy(Path(__file__).with_name("conf.py"), folder / "conf.py")
    (folder / "templates").mkdir()
    shutil.copy(Path(__file__).with_name("versions.html"), folder / "templates")


def pages() -> Iterator[tuple[str, str]]:
    """Yield the path of each page below the root of the site, and its Markdown."""
    yield from written_pages()
    yield "index.md", index()
    yield "reference/verbs.md", verbs_page()
    yield "reference/classes.md", classes_page()
    yield "reference/grammar.md", grammar_page()
    yield from rule_pages()


def written_pages() -> Iterator[tuple[str, str]]:
    """Yield the pages that lie in the repository."""
    for file in sorted((ROOT / "docs").rglob("*.md")):
        page = file.relative_to(ROOT / "docs").as_posix()
        yield page, linked(file.read_text(encoding="utf-8"), f"docs/{page}", page)
    for name, page in BESIDE.items():
        yield page, linked((ROOT / name).read_text(encoding="utf-8"), name, page)


def linked(text: str, origin: str, page: str) -> str:
    """Return a page whose links lead to pages of the site."""

    def led(match: re.Match[str]) -> str:
        to, part = match["to"], match["part"] or ""
        if re.match(r"[a-z]+:", to):
            return match[0]
        meant = posixpath.normpath(posixpath.join(posixpath.dirname(origin), to))
        if meant in BESIDE:
            found = BESIDE[meant]
        elif meant.startswith("docs/") and meant.endswith(".md"):
            found = meant.removeprefix("docs/")
        else:
            own = match["text"].strip("`")
            return f"`{meant}`" if own == posixpath.basename(meant) else f"{own} (`{meant}`)"
        return f"[{match['text']}]({posixpath.relpath(found, posixpath.dirname(page))}{part})"

    return LINK.sub(led, text)


def index() -> str:
    """Return the first page: the head of the README, and all others."""
    readme = linked((ROOT / "README.md").read_text(encoding="utf-8"), "README.md", "index.md")
    head = readme.partition("## Read on")[0].replace("docs/pictures/", "pictures/")
    head = IMAGE.sub(r"![\2](\1)", head)
    lines = [head]
    for folder, title in SHELVES.items():
        names = sorted(file.stem for file in (ROOT / "docs" / folder).glob("*.md"))
        made = ["classes", "grammar", "rules/index", "verbs"] if folder == "reference" else []
        lines += _tree(title, [f"{folder}/{name}" for name in (*names, *made)])
    lines += _tree("About", [page.removesuffix(".md") for page in BESIDE.values()])
    return "\n".join(lines)


def _tree(title: str, names: list[str]) -> list[str]:
    return ["```{toctree}", ":hidden:", f":caption: {title}", "", *names, "```", ""]


def verbs_page() -> str:
    """Return the page of all verbs with their options, as the command line prints them."""
    lines = ["# The verbs", "", "Each verb, as `fsmkit VERB --help` prints it.", ""]
    with click.Context(
        verbs, info_name="fsmkit", terminal_width=WIDTH, max_content_width=WIDTH
    ) as top:
        for name in verbs.list_commands(top):
            command = verbs.get_command(top, name)
            if command is not None:
                with click.Context(command, top, name) as context:
                    lines += [f"## {name}", "", "```text", command.get_help(context), "```", ""]
    return "\n".join(lines)


def classes_page() -> str:
    """Return the page of the public classes, from their docstrings."""
    lines = ["# The public classes", "", "The functions are in [the Python API](api.md).", ""]
    for name in fsmkit.__all__:
        if isinstance(getattr(fsmkit, name), type):
            directive = f".. autoclass:: fsmkit.{name}\n   :members:\n   :no-index:"
            lines += [f"## `fsmkit.{name}`", "", "```{eval-rst}", directive, "```", ""]
    return "\n".join(lines)


def grammar_page() -> str:
    """Return the grammar of expressions, statements and declarations."""
    return (
        "# The grammar\n\nThe grammar of expressions, statements and declarations, in the notation "
        f"of [Lark](https://lark-parser.readthedocs.io).\n\n```text\n{GRAMMAR.read_text()}```\n"
    )


def rule_pages() -> Iterator[tuple[str, str]]:
    """Yield a page for each rule, and the page that lists them.

    Only that one is in the margin: with hundreds of rules in it, each page would be large.
    """
    lines = [
        "# The rules",
        "",
        RULES,
        "",
        "| code | name | severity |",
        "|---|---|---|",
    ]
    for rule in rules():
        lines.append(f"| [{rule.code}]({rule.code}.md) | `{rule.name}` | {rule.severity.value} |")
        text = rule.explanation.replace("\n```\n", "\n```text\n", 1)
        head = (
            f"---\norphan: true\n---\n\n# {rule.code} {rule.name}\n\n"
            f"A finding of this rule is {_article(rule.severity)}: it "
        )
        yield f"reference/rules/{rule.code}.md", f"{head}{SEVERITIES[rule.severity]}.\n\n{text}\n"
    yield "reference/rules/index.md", "\n".join(lines)


def _article(severity: Severity) -> str:
    return f"an {severity.value}" if severity is Severity.ERROR else f"a {severity.value}"
