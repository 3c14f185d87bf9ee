"""Each verb with `--json` has a schema of its document, and the schemas are correct and strict."""

from __future__ import annotations

import json

import click
import jsonschema
import pytest

from fsmkit.cli import cli, execute
from fsmkit.cli.common.result_schemas import RESULTS
from tests.documents import checked, strict, validator


def verbs_with_json() -> set[str]:
    context = click.Context(cli)
    commands = {name: cli.get_command(context, name) for name in cli.list_commands(context)}
    return {
        name
        for name, command in commands.items()
        if command is not None and any("--json" in param.opts for param in command.params)
    }


def test_each_verb_with_json_has_a_schema() -> None:
    assert set(RESULTS) == verbs_with_json()


@pytest.mark.parametrize("verb", sorted(RESULTS))
def test_a_schema_is_printed_and_valid(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["schema", f"{verb}-result"]) == 0
    printed = json.loads(capsys.readouterr().out)
    jsonschema.Draft202012Validator.check_schema(printed)
    assert printed["$id"].endswith(f":{verb}-result")
    assert not validator(verb).is_valid([{"unknown": 1}])
    error = {"code": "FK0101", "rule": "r", "severity": "error", "message": "m"}
    assert validator(verb).is_valid({"verdict": "error", "findings": [error]})


def test_an_unknown_key_is_noticed() -> None:
    assert strict({"properties": {"a": {}}}) == {
        "properties": {"a": {}},
        "additionalProperties": False,
    }
    with click.Context(click.Command("deploy"), info_name="deploy"):
        assert json.loads(checked({"files": []})) == {"files": []}
        with pytest.raises(jsonschema.ValidationError):
            checked({"files": [], "more": 1})
