"""The JSON Schema of bindings accepts what the reader accepts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from fsmkit.codegen.existing_c import schema
from tests.codegen.existing_c.conftest import HEAD
from tests.codegen.existing_c.test_checks import WHOLE

EXAMPLE = Path(__file__).parents[3] / "fsmkit/cli/examples/charger/charger.c.yaml"


@pytest.fixture(scope="module")
def validator() -> Any:
    return jsonschema.Draft202012Validator(schema.schema())


def test_it_is_a_schema() -> None:
    jsonschema.Draft202012Validator.check_schema(schema.schema())


def test_bindings_are_valid(validator: Any) -> None:
    validator.validate(yaml.safe_load(EXAMPLE.read_text()))
    validator.validate(yaml.safe_load(HEAD + WHOLE))


@pytest.mark.parametrize(
    "text",
    ["binding: Pump\n", HEAD + "inputs: {a: {fetch: x}}", HEAD + "names: {Fault: x}",
     HEAD + "exports: all", HEAD + "types: {Fault: {members: {}}}", HEAD + "wires: {}"],
)  # fmt: skip
def test_what_the_reader_refuses_is_not(text: str, validator: Any) -> None:
    assert list(validator.iter_errors(yaml.safe_load(text))) != []
