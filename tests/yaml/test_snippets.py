"""Every YAML snippet of the documents is read."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from fsmkit.carriers.wires.keys import BOARD
from fsmkit.codegen.existing_c.keys import BINDING
from fsmkit.diagnostics import Findings, Severity, Source, render
from fsmkit.diagnostics.rules import Rule, rules
from fsmkit.document import keys
from fsmkit.testing.reading import KEYS
from fsmkit.verify.campaign.keys import CAMPAIGN
from fsmkit.yaml.nodes import Mapping, read_nodes
from fsmkit.yaml.reader import read_document

ROOT = Path(__file__).parents[2]
DESIGN = ROOT.parent / "shared/design/LANGUAGE.md"
PAGES = [
    *sorted(ROOT.glob("*.md")),
    *sorted(ROOT.glob("docs/**/*.md")),
    *sorted(ROOT.glob("machines/**/*.md")),
]
SNIPPET = re.compile(r"^```yaml\n(.*?)^```", re.DOTALL | re.MULTILINE)


def snippets(page: Path) -> list[tuple[str, str]]:
    text = page.read_text()
    return [
        (f"{page.name}:{text.count(chr(10), 0, match.start()) + 2}", match[1])
        for match in SNIPPET.finditer(text)
    ]


FOUND = [one for page in (*PAGES, *([DESIGN] if DESIGN.exists() else [])) for one in snippets(page)]


@pytest.mark.parametrize(("name", "text"), FOUND, ids=[name for name, _ in FOUND])
def test_snippets_are_read(name: str, text: str) -> None:
    if text.startswith(" "):  # lines from the middle of a file
        return
    findings = Findings()
    source = Source(name, text)
    root = read_nodes(source, findings)
    assert isinstance(root, Mapping)
    top = {key.value for key, _ in root.entries}
    if top <= keys.DEPLOYMENT.keys() - keys.SYSTEM.keys():  # a part of a deployment
        return
    if "tests" in top:  # how files of tests are read has tests of its own
        assert top <= set(KEYS)
        return
    if "binding" in top:  # how bindings are read has tests of its own
        assert top <= BINDING.keys()
        return
    if "campaign" in top:  # how campaigns are read has tests of its own
        assert top <= CAMPAIGN.keys()
        return
    if "board" in top:  # it names files; how boards are read has tests of its own
        assert top <= BOARD.keys()
        return
    if "system" not in top:
        if "chart" not in top:  # a part of a chart, or of a state
            is_state = not top <= {
                "types",
                "data",
                "events",
                "operations",
                "properties",
                "req",
                "inputs",
                "states",
                "refine",
            }
            inside = "states:\n  part:\n" + "".join(f"    {line}\n" for line in text.splitlines())
            source = Source(name, f"chart: Part\n{inside if is_state else text}")
        read_document(source, findings)
    assert not findings.has_errors, "\n".join(render(finding) for finding in findings)


def test_there_are_snippets() -> None:
    assert len(FOUND) >= 2


YAML_RULES = [
    rule
    for rule in rules()
    if "FK0120" <= rule.code <= "FK0149" and SNIPPET.search(rule.explanation + "\n")
]


@pytest.mark.parametrize("rule", YAML_RULES, ids=lambda rule: rule.name)
def test_rules_show_what_they_find(rule: Rule) -> None:
    """The example of a rule of this notation has the finding, the text instead has none."""
    bad, good = (found_in(text) for text in SNIPPET.findall(rule.explanation + "\n"))
    assert rule.name in bad
    assert rule.name not in good


def found_in(text: str) -> set[str]:
    findings = Findings()
    source = Source("example.yaml", text)
    root = read_nodes(source, findings)
    top = {key.value for key, _ in root.entries} if isinstance(root, Mapping) else set()
    if not top & {"chart", "initial"}:
        prefix = "chart: Part\n"
        if "states" not in top and "events" not in top:
            prefix += "states:\n  part:\n" if top & {"on", "if"} else "states:\n"
        margin = "    " if "part:" in prefix else "  " if prefix.endswith("states:\n") else ""
        if "if" in top or (root is None and text.startswith("if")):
            prefix += "    always:\n"
            margin = "      "
        source = Source(
            "example.yaml", prefix + "".join(f"{margin}{line}\n" for line in text.splitlines())
        )
    read_document(source, findings)
    return {f.rule.name for f in findings if f.severity is Severity.ERROR}
