"""The schemas of tests, of campaigns and of the project file."""

from __future__ import annotations

from fsmkit.document.project.keys import CHECK, COMPILE, LEVELS, PROJECT
from fsmkit.editor.schemas.shapes import FLAG, NAMES, TEXT, TEXTS, Schema, either, record, table
from fsmkit.testing.reading import EXPECTATIONS, KEYS
from fsmkit.verify.campaign.keys import CAMPAIGN, ENGINES, FUZZED, LOSSY, RUNS, WITHIN
from fsmkit.verify.resources.time import TIMES

RULE = r"^([a-z]+(-[a-z]+)*|FK\d+)$"
"""The name or the code of a rule; which there are, the reader knows: they change too often here."""


def tests_schema() -> Schema:
    """Return the schema of the tests of a chart or a system."""
    one_or_more = either(TEXT, TEXTS)
    special: dict[str, Schema] = {"only": FLAG}
    expectations = {key: special.get(key, one_or_more) for key in EXPECTATIONS}
    expect = {"type": "object", "properties": expectations, "additionalProperties": False}
    step = either(
        TEXT, {"type": "object", "properties": {"expect": expect}, "additionalProperties": False}
    )
    steps: Schema = {"type": ["array", "null"], "items": step}
    case = {
        "type": "object",
        "properties": {"req": NAMES, "steps": steps},
        "additionalProperties": False,
    }
    parts: dict[str, Schema] = {
        "req": NAMES,
        "before": steps,
        "cases": table(either(steps, case)),
    }
    return {
        "title": "Tests of a chart or a system of fsmkit",
        "type": "object",
        "properties": {key: parts.get(key, TEXT) for key in KEYS},
        "additionalProperties": False,
        "required": ["tests", "cases"],
        "oneOf": [{"required": ["chart"]}, {"required": ["system"]}],
    }


def project_schema() -> Schema:
    """Return the schema of `fsmkit.toml`."""
    text: Schema = {"type": "string"}
    paths: Schema = either(text, {"type": "array", "items": text})
    special: dict[str, Schema] = {
        "search": paths,
        "exclude": paths,
        "rules": {
            "type": "object",
            "patternProperties": {RULE: {"enum": [*LEVELS]}},
            "additionalProperties": False,
        },
        "check": record(CHECK, dict.fromkeys(CHECK, text)),
        "compile": record(COMPILE, dict.fromkeys(COMPILE, text)),
    }
    return {"title": "The project file of fsmkit", **record(PROJECT, special)}


def campaign_schema() -> Schema:
    """Return the schema of a campaign."""
    one_or_more = either(TEXT, TEXTS)
    special: dict[str, Schema] = {
        "set": table(one_or_more),
        "time": {"enum": [*TIMES]},
        "silent": FLAG,
        "engine": {"enum": [*ENGINES]},
        "storage": {"enum": [*LOSSY]},
        "target": {"enum": [*FUZZED]},
        **dict.fromkeys(("check", "mutants", "swarm", "property", "seeds"), one_or_more),
        **{kind: record(keys, {"target": {"enum": [*FUZZED]}}) for kind, keys in WITHIN.items()},
    }
    runs = [
        record(keys, {name: special[name] for name in keys if name in special}, required=[kind])
        for kind, keys in RUNS.items()
    ]
    return {
        "title": "A campaign of fsmkit",
        **record(CAMPAIGN, {"runs": {"type": "array", "items": either(*runs)}}),
        "required": ["campaign", "runs"],
    }
