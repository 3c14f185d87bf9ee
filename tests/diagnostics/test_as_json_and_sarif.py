"""Findings as data: nothing is lost, and SARIF has the shape its readers demand."""

from __future__ import annotations

import json
from typing import Any

import jsonschema
import pytest

from fsmkit.diagnostics import Diagnostic, Findings, Severity, Source, Span
from fsmkit.diagnostics.as_json import as_json
from fsmkit.diagnostics.sarif import sarif_log

SOURCE = Source("charts/a b.yaml", "chart: Lamp\ninitial: öff\nstates: {off: {}}\n")

TEXT = {"type": "object", "required": ["text"], "properties": {"text": {"type": "string"}}}
LEVEL = {"enum": ["none", "note", "warning", "error"]}
PLACE = {
    "type": "object",
    "required": ["physicalLocation"],
    "properties": {
        "message": TEXT,
        "physicalLocation": {
            "type": "object",
            "required": ["artifactLocation", "region"],
            "properties": {
                "artifactLocation": {
                    "required": ["uri"],
                    "properties": {"uri": {"type": "string", "pattern": "^[^ ]+$"}},
                },
                "region": {
                    "required": ["startLine"],
                    "additionalProperties": False,
                    "properties": {
                        name: {"type": "integer", "minimum": 1}
                        for name in ("startLine", "startColumn", "endLine", "endColumn")
                    },
                },
            },
        },
    },
}
SARIF = {
    "type": "object",
    "required": ["version", "runs"],
    "properties": {
        "version": {"const": "2.1.0"},
        "$schema": {"type": "string"},
        "runs": {
            "type": "array",
            "items": {
                "type": "object",
                "required": ["tool", "results"],
                "properties": {
                    "columnKind": {"enum": ["utf16CodeUnits", "unicodeCodePoints"]},
                    "tool": {
                        "required": ["driver"],
                        "properties": {
                            "driver": {
                                "required": ["name"],
                                "properties": {
                                    "rules": {
                                        "type": "array",
                                        "uniqueItems": True,
                                        "items": {
                                            "required": ["id"],
                                            "properties": {
                                                "shortDescription": TEXT,
                                                "fullDescription": TEXT,
                                                "help": TEXT,
                                                "defaultConfiguration": {
                                                    "properties": {"level": LEVEL}
                                                },
                                            },
                                        },
                                    }
                                },
                            }
                        },
                    },
                    "results": {
                        "type": "array",
                        "items": {
                            "required": ["message"],
                            "properties": {
                                "ruleId": {"type": "string"},
                                "ruleIndex": {"type": "integer", "minimum": 0},
                                "level": LEVEL,
                                "message": TEXT,
                                "locations": {"type": "array", "items": PLACE},
                                "relatedLocations": {"type": "array", "items": PLACE},
                            },
                        },
                    },
                },
            },
        },
    },
}
"""SARIF 2.1.0 of the written objects, as a schema (sections 3.13, 3.14, 3.27, 3.28)."""


@pytest.fixture
def findings() -> Findings:
    found = Findings()
    found.add(
        "unknown-name", "there is no state `öff`", Span(SOURCE, 21, 24), label="here",
        secondary=[(Span(SOURCE, 33, 36), "this one?")], help="did you mean `off`?",
    )  # fmt: skip
    found.add("unreadable-file", "cannot read `x`", None)
    found.add("unused-event", "nothing takes `e`", Span(SOURCE, 0, 5), severity=Severity.NOTE)
    return found


def test_json(findings: Findings) -> None:
    first, second, third = (as_json(d) for d in findings)
    assert json.loads(json.dumps(first)) == {
        "code": "FK0201",
        "rule": "unknown-name",
        "severity": "error",
        "message": "there is no state `öff`",
        "at": {
            "file": "charts/a b.yaml", "line": 2, "column": 10, "end_line": 2, "end_column": 13,
            "label": "here",
        },
        "see": [{
            "file": "charts/a b.yaml", "line": 3, "column": 9, "end_line": 3, "end_column": 12,
            "label": "this one?",
        }],
        "help": "did you mean `off`?",
    }  # fmt: skip
    assert set(second) == {"code", "rule", "severity", "message"}
    assert third["severity"] == "note"


def test_sarif(findings: Findings) -> None:
    log: Any = json.loads(json.dumps(sarif_log(findings, "1.2.3")))
    jsonschema.validate(log, SARIF)
    (run,) = log["runs"]
    driver = run["tool"]["driver"]
    assert (driver["name"], driver["semanticVersion"]) == ("fsmkit", "1.2.3")
    first, second, third = run["results"]
    for result in run["results"]:
        assert driver["rules"][result["ruleIndex"]]["id"] == result["ruleId"]
    assert (first["ruleId"], first["level"], third["level"]) == ("FK0201", "error", "note")
    assert "did you mean `off`?" in first["message"]["text"]
    place = first["locations"][0]["physicalLocation"]
    assert place["artifactLocation"]["uri"] == "charts/a%20b.yaml"
    assert place["region"] == {"startLine": 2, "startColumn": 10, "endLine": 2, "endColumn": 13}
    assert first["relatedLocations"][0]["message"]["text"] == "this one?"
    assert "locations" not in second
    assert all(rule["fullDescription"]["text"] for rule in driver["rules"])


def test_an_absolute_name_is_a_file_uri() -> None:
    found = Findings()
    found.add("unused-event", "x", Span(Source("/a/b c.yaml", "x"), 0, 1))
    log: Any = sarif_log(found, "1")
    place = log["runs"][0]["results"][0]["locations"][0]["physicalLocation"]
    assert place["artifactLocation"]["uri"] == "file:///a/b%20c.yaml"


def test_no_findings_are_a_log_too() -> None:
    log: Any = sarif_log((), "1")
    jsonschema.validate(log, SARIF)
    assert log["runs"][0]["results"] == []


def test_a_finding_without_a_place_survives(findings: Findings) -> None:
    kept: list[Diagnostic] = [d for d in findings if d.primary is None]
    assert len(kept) == 1
