"""The schemas: equal to the key tables, and true of the files of the repository."""

from __future__ import annotations

import json
import os
import re
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

import fsmkit
from fsmkit.cli import execute
from fsmkit.cli.common.result_schemas import RESULTS
from fsmkit.editor.schemas import FOLDER, KINDS, schema_of, text_of

ROOT = Path(__file__).parents[3]


class Loader(yaml.SafeLoader):
    """YAML as editors read it: 1.2, in which `on` and `off` are texts."""


Loader.yaml_implicit_resolvers = {
    first: [pair for pair in pairs if pair[0] != "tag:yaml.org,2002:bool"]
    for first, pairs in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
Loader.add_implicit_resolver("tag:yaml.org,2002:bool", re.compile("^(true|false)$"), list("tf"))


def loaded(path: Path) -> Any:
    return yaml.load(path.read_text(encoding="utf-8"), Loader)


def kind_of(document: Any) -> str | None:
    if not isinstance(document, dict):
        return None
    for key, kind in (
        ("board", None), ("binding", "binding"), ("cases", "tests"), ("nodes", "deployment"),
        ("system", "system"), ("chart", "chart"),
    ):  # fmt: skip
        if key in document:
            return kind
    return None


@pytest.mark.parametrize("kind", KINDS)
def test_the_files_are_as_the_key_tables_are(kind: str) -> None:
    made, file = text_of(kind, fsmkit.__version__), FOLDER / f"{kind}.json"
    if os.environ.get("FSMKIT_BLESS"):
        file.write_text(made, encoding="utf-8")
    assert file.read_text(encoding="utf-8") == made, "run `python -m fsmkit.editor.schemas`"
    schema = schema_of(kind, fsmkit.__version__)
    assert schema["$id"] == f"urn:fsmkit:schema:{fsmkit.__version__}:{kind}"
    jsonschema.Draft202012Validator.check_schema(schema)


def test_each_file_of_the_machines_is_valid() -> None:
    validators = {kind: jsonschema.Draft202012Validator(schema_of(kind, "1")) for kind in KINDS}
    counts = dict.fromkeys(KINDS, 0)
    for path in sorted((ROOT / "machines").rglob("*.yaml")):
        document = loaded(path)
        kind = kind_of(document)
        if kind is not None:
            errors = [error.message for error in validators[kind].iter_errors(document)]
            assert errors == [], path
            counts[kind] += 1
    assert counts["chart"] > 30
    assert counts["system"] > 5
    assert counts["deployment"] >= 2


# kind: (what is valid, what is not)
EXAMPLES: dict[str, tuple[list[str], list[str]]] = {
    "system": (
        [
            "{system: S, machines: {a: b}, connect: [a.x -> a.y, {a.x -> a.y: {kind: lossy}}]}",
            "{system: S, machines: {a: {chart: b, with: {N: 1}}}, properties: {D: deadlock_free}}",
            "{system: S, machines: {a: b}, environment: {world: [a], may: [a.x], will: [a]}}",
            "{system: S, machines: {a: a.yaml}, properties: {W: {within: [x, 5ms, y]}}}",
        ],
        [
            "{machines: {a: a.yaml}}",
            "{system: S, machines: {a: a.yaml}, propertys: {}}",
            "{system: S, machines: {a: a.yaml}, properties: {D: deadlok_free}}",
            "{system: S, machines: {a: a.yaml}, properties: {W: {within: [x, y]}}}",
            "{system: S, machines: {a: a.yaml}, connect: [{a.x -> a.y: {kind: quick}}]}",
        ],
    ),
    "deployment": (
        ["{system: s.yaml, nodes: {a: [b], c: {machines: [d], foreign: can}}}"],
        ["{system: s.yaml}", "{system: s.yaml, nodes: {a: {machine: [b]}}}"],
    ),
    "tests": (
        ["{tests: T, chart: a.yaml, cases: {one: [post x, {expect: {in: a, only: true}}]}}"],
        ["{tests: T, cases: {}}", "{tests: T, chart: a, cases: {one: [{expects: {in: a}}]}}"],
    ),
    "binding": (["{binding: A, chart: a.yaml}"], ["{binding: A, charts: a.yaml}"]),
}


@pytest.mark.parametrize("kind", EXAMPLES)
def test_wrong_keys_and_words_are_refused(kind: str) -> None:
    validator = jsonschema.Draft202012Validator(schema_of(kind, "1"))
    good, bad = EXAMPLES[kind]
    for text in good:
        assert validator.is_valid(yaml.load(text, Loader)), text
    for text in bad:
        assert not validator.is_valid(yaml.load(text, Loader)), text


def test_the_project_of_the_reference_is_valid() -> None:
    page = (ROOT / "docs" / "reference" / "command-line.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    validator = jsonschema.Draft202012Validator(schema_of("project", "1"))
    table = tomllib.loads(block)["tool"]["fsmkit"]
    assert validator.is_valid(table)
    assert not validator.is_valid({**table, "rules": {"unread-data": "no"}})
    assert not validator.is_valid({**table, "rules": {"Unread data": "off"}})


def test_a_schema_is_printed_or_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["schema"]) == 0
    listed = [line.split()[0] for line in capsys.readouterr().out.splitlines()]
    names = [*sorted(KINDS), *(f"{verb}-result" for verb in sorted(RESULTS))]
    assert listed == names
    assert execute(["schema", "chart"]) == 0
    assert json.loads(capsys.readouterr().out)["title"] == "A statechart of fsmkit"
    assert execute(["schema", "tests", "--out", str(tmp_path / "a" / "t.json")]) == 0
    assert json.loads((tmp_path / "a" / "t.json").read_text())["required"] == ["tests", "cases"]
    capsys.readouterr()
    assert execute(["schema", "--json"]) == 0
    assert set(json.loads(capsys.readouterr().out)["kinds"]) == set(names)
    assert execute(["schema", "sistem"]) == 2
    assert "did you mean `system`?" in capsys.readouterr().err
    assert execute(["schema", "--out", "x"]) == 2
