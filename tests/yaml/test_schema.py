from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from fsmkit.document import keys
from fsmkit.document.keys import Form
from fsmkit.yaml import schema
from tests.reading import charts_of_machines

ROOT = Path(__file__).parents[2]
CHARTS = charts_of_machines()


class Loader(yaml.SafeLoader):
    """YAML as editors read it: 1.2, in which `on` and `off` are texts."""


Loader.yaml_implicit_resolvers = {
    first: [pair for pair in pairs if pair[0] != "tag:yaml.org,2002:bool"]
    for first, pairs in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
Loader.add_implicit_resolver("tag:yaml.org,2002:bool", re.compile("^(true|false)$"), list("tf"))


@pytest.fixture(scope="module")
def validator() -> Any:
    return jsonschema.Draft202012Validator(schema.schema())


def test_it_is_a_schema() -> None:
    jsonschema.Draft202012Validator.check_schema(schema.schema())


def test_every_shape_is_of_a_key() -> None:
    tables = (keys.CHART, keys.STATE, keys.LABELLED, keys.INITIAL, keys.INVOKE, keys.DONE)
    rows = [row for table in tables for row in table.values()]
    assert set(schema.CODECS) <= {row.name for row in rows if row.form is Form.OWN}


@pytest.mark.parametrize("path", CHARTS, ids=lambda path: path.name)
def test_charts_are_valid(path: Path, validator: Any) -> None:
    validator.validate(yaml.load(path.read_text(), Loader))


@pytest.mark.parametrize(
    "text",
    [
        "states: {}",
        "{chart: X, inputz: {}}",
        "{chart: X, states: {a: {entri: b}}}",
        "{chart: X, states: {a: {on: {e: {goto: b}}}}}",
        "{chart: X, states: {a: {history: far}}}",
        "{chart: X, states: {a: {transitions: [{type: inner}]}}}",
        "{chart: X, events: {inn: [a]}}",
        "{chart: X, capacity: {size: 1}}",
    ],
)
def test_what_the_reader_refuses_is_invalid(text: str, validator: Any) -> None:
    assert not validator.is_valid(yaml.load(text, Loader))
