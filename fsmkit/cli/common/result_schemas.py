"""JSON Schemas of the documents that verbs print with ``--json``, by verb.

A reader of these documents ignores keys that it does not know: later releases add keys. The tests
compare every document that they print with these schemas, and accept no other key.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

Schema = dict[str, Any]

STRING: Schema = {"type": "string"}
BOOL: Schema = {"type": "boolean"}
INT: Schema = {"type": "integer"}
NUMBER: Schema = {"type": "number"}
COUNT: Schema = {"type": ["integer", "string"]}
"""A number, or its decimal digits where it is too long for a number."""
VALUE: Schema = {}
"""A value of a chart: a number, a string, a boolean, an array or an object."""


def _list(items: Schema) -> Schema:
    return {"type": "array", "items": items}


def _map(values: Schema) -> Schema:
    return {"type": "object", "additionalProperties": values}


def _or_null(schema: Schema) -> Schema:
    return {"anyOf": [schema, {"type": "null"}]}


def _object(keys: Mapping[str, Schema]) -> Schema:
    """Return the schema of an object; a key that ends with ``?`` is optional."""
    return {
        "type": "object",
        "properties": {key.removesuffix("?"): schema for key, schema in keys.items()},
        "required": [key for key in keys if not key.endswith("?")],
    }


STRINGS, INTS = _list(STRING), _list(INT)
VERDICT: Schema = {"enum": ["holds", "violated", "undecided"]}

LOCATION = {
    "file": STRING, "line": INT, "column": INT, "end_line": INT, "end_column": INT,
}  # fmt: skip
LABEL = _object({**LOCATION, "label?": STRING})
FINDING = _object({
    "code": STRING, "rule": STRING, "severity": {"enum": ["error", "warning", "note"]},
    "message": STRING, "at?": LABEL, "see?": _list(LABEL), "help?": STRING,
})  # fmt: skip
FINDINGS = _list(FINDING)
ERROR = _object({"verdict": {"const": "error"}, "findings": FINDINGS})
FILES = _object({"files": STRINGS})

TRACE = _list(_object({
    "at": _or_null(INT), "machine": STRING, "action": STRING, "event": STRING, "from": STRINGS,
    "to": STRINGS, "chosen": STRINGS, "sent": STRINGS, "lines": STRINGS,
}))  # fmt: skip
"""The steps of a path; ``at``: microseconds since the start, null where time does not count."""

PROPERTY = _object({
    "name": STRING, "kind": STRING, "verdict": VERDICT, "reason?": STRING, "trace?": TRACE,
    "replayed?": STRINGS, "shortest?": BOOL,
})  # fmt: skip
SEARCH = _object({
    "engine": {"enum": ["explicit", "symbolic"]}, "nodes?": INT, "peak?": INT, "bytes?": INT,
    "order?": STRINGS, "order_from?": STRING, "events?": INT, "explicit_states?": _or_null(INT),
})  # fmt: skip
STORAGE = _object({
    "kind": STRING, "bytes?": INT, "match_probability?": NUMBER,
    "expected_omissions?": _or_null(NUMBER), "omission_probability?": _or_null(NUMBER),
})  # fmt: skip
RANKS = _object({
    "ranks": INT, "forwarded": INT, "filtered": INT, "sent": INT, "resident": INT,
    "seconds": NUMBER,
})  # fmt: skip
REPORT_KEYS = {
    "verdict": VERDICT, "states": COUNT, "zones?": _or_null(INT), "transitions": COUNT,
    "depth": _or_null(INT), "seconds": NUMBER, "engine": STRING, "cores": INT,
    "spent": _map(NUMBER), "time": {"enum": ["zones", "discrete", "untimed", "none"]},
    "max_pending": _or_null(INT), "exact": BOOL, "search": SEARCH, "ranks?": RANKS,
    "storage": STORAGE, "complete": BOOL, "properties": _list(PROPERTY), "findings": FINDINGS,
    "bounds": _map(_object({"queue": INT, "timers": INT, "microsteps": INT})),
    "parameters": _map(VALUE), "assumptions": STRINGS,
}  # fmt: skip
REPORT = _object(REPORT_KEYS)
FILE_REPORT: Schema = {
    "anyOf": [
        _object({"file": STRING, **REPORT_KEYS}),
        _object({"file": STRING, "verdict": {"const": "error"}, "findings": FINDINGS}),
    ]
}
ANY_NUMBER = _object({
    "verdict": VERDICT, "parameter": STRING, "least": INT,
    "properties": _list(_object({
        "name": STRING, "kind": STRING, "verdict": VERDICT, "reason": STRING, "value?": INT,
        "trace?": TRACE, "replayed?": STRINGS,
    })),
    "views": _or_null(_object({
        "method": STRING, "width": INT, "views": INT, "least": INT, "sums": INT,
        "seconds": NUMBER,
    })),
    "explored": _list(_object({"value": INT, "states": INT, "verdict": VERDICT})),
    "seconds": NUMBER, "findings": FINDINGS,
})  # fmt: skip
"""The result of `--set N=any`."""
CHECK: Schema = {
    "anyOf": [
        REPORT,
        ANY_NUMBER,
        _object({"code": INT, "files": _list(FILE_REPORT)}),
        _object({"bindings": _list(_map(VALUE)), "findings": FINDINGS}),
        _object({"boards": _list(_map(VALUE)), "findings": FINDINGS}),
    ]
}

SIZE = _object({"states": INT, "transitions": INT, "events": INT})
REMARKS = _list(_object({"message": STRING, "at": LABEL}))
IMPORT = _object({
    "machine": STRING, "read": SIZE, "kept": SIZE,
    "rewritten": _list(_object({"rule": STRING, "at": LABEL, "ids": STRINGS})),
    "opaque": _list(_object({
        "name": STRING, "role": {"enum": ["action", "guard", "delay"]}, "text": STRING, "at": LABEL,
    })),
    "rejected": _list(_object({"code": STRING, "message": STRING, "at?": LABEL})),
    "lost": REMARKS, "differs": REMARKS,
})  # fmt: skip
"""The report of an import."""
MUTANT = _object({
    "machine": STRING, "operator": STRING, "what": STRING, "place": _or_null(STRING),
    "fate": STRING, "by": STRINGS, "states": INT, "systems": STRINGS, "why?": STRING,
    "diff?": STRINGS, "run?": TRACE, "run_of?": {"enum": ["mutant", "original"]},
    "local?": STRINGS,
})  # fmt: skip
MUTANTS = _object({
    "verdict": VERDICT, "mutants": _list(MUTANT), "score": _or_null(NUMBER),
    "machines": _map(_map(_or_null(NUMBER))), "possible": INT, "same": INT, "broken": INT,
    "left": INT, "wanted": INT, "ended": STRING,
})  # fmt: skip
REFINE = _object({
    "verdict": VERDICT, "derived?": STRING, "base?": STRING, "time?": STRING, "pairs?": INT,
    "steps?": INT, "seconds?": NUMBER, "reason?": STRING,
    "trace?": _list(_object({"event": STRING, "to": STRINGS, "seen": STRINGS})),
})  # fmt: skip
TRAIL = _object({
    "property": STRING, "verdict": VERDICT, "trace": TRACE, "replayed": STRINGS,
})  # fmt: skip
EXPORT: Schema = {"anyOf": [TRAIL, _map({"type": ["integer", "string"]})]}

ORIGIN = {"origin?": STRING, "at?": _object(LOCATION)}
FIELDS = _list(_object({"name": STRING, "type": STRING}))
BLOCKS = _list(STRINGS)
VARIABLES = _list(_object({"name": STRING, "type": STRING, "start": STRING, **ORIGIN}))
CAPACITIES = _map(INT)
CHART_KEYS = {
    "name": STRING, "doc": STRING, "req": STRINGS, "base": _or_null(STRING), "abstract": BOOL,
    "sources": STRINGS,
    "capacities": CAPACITIES,
    "types": _list(_object({
        "name": STRING, "members?": STRINGS, "numbers?": INTS, "fields?": FIELDS, **ORIGIN,
    })),
    "constants": _list(_object({"name": STRING, "value": STRING, **ORIGIN})),
    "data": VARIABLES, "inputs": VARIABLES, "outputs": VARIABLES,
    "operations": _list(_object({
        "name": STRING, "parameters": FIELDS, "result": _or_null(STRING), "tried?": _list(VALUE),
        "req": STRINGS, **ORIGIN,
    })),
    "functions": _list(_object({
        "name": STRING, "parameters": FIELDS, "result": STRING, "body": STRINGS, **ORIGIN,
    })),
    "events": _list(_object({
        "name": STRING, "directions": STRINGS, "fields": FIELDS, "reply": _or_null(STRING),
        **ORIGIN,
    })),
    "script": STRINGS,
    "states": _list(_object({
        "id": STRING, "kind": STRING, "parent": _or_null(STRING), "children": STRINGS,
        "initial": _or_null(INT), "transitions": INTS, "entry": BLOCKS, "exit": BLOCKS,
        "invoke": BLOCKS, "defer": STRINGS, "invariant": _or_null(STRING), "doc": STRING,
        "abstract": BOOL, "rest": BOOL, "req": STRINGS, **ORIGIN,
    })),
    "transitions": _list(_object({
        "index": INT, "source": STRING, "trigger": STRING, "descriptors": STRINGS,
        "events": STRINGS, "delay_us": _or_null(INT), "guard": _or_null(STRING),
        "targets": STRINGS, "content": STRINGS, "id": _or_null(STRING), "internal": BOOL,
        "watchdog": BOOL, "ordered": BOOL, "req": STRINGS, **ORIGIN,
    })),
    "invocations": _list(_object({
        "id": STRING, "state": STRING, "given": STRINGS, "autoforward": BOOL,
        "finalize": _map(STRINGS), "at?": _object(LOCATION), "chart": {"type": "object"},
    })),
    "properties": _list(_object({
        "name": STRING, "kind": STRING, "parts": VALUE, "watch?": STRINGS, "req": STRINGS,
        **ORIGIN,
    })),
    "environment": _or_null(VALUE), "plan?": VALUE,
}  # fmt: skip
SYSTEM = _object({
    "name": STRING,
    "machines": _list(_object({
        "name": STRING, "chart": STRING, "file": _or_null(STRING), "states": INT,
        "environment": BOOL, "started?": STRINGS, "any_start?": STRINGS,
    })),
    "connections": STRINGS, "shared": _map(VALUE),
    "environment": _list(_object({"event": STRING, "fair": BOOL})), "free_inputs": STRINGS,
    "freezes": _list(_object({
        "node": STRING, "machines": STRINGS, "silent": STRINGS, "within": INTS,
        "continues": _or_null(INT),
    })),
    "properties": _list(_object({"name": STRING, "kind": STRING, "text": STRING})),
})  # fmt: skip

STEPS = _list(_object({
    "machine?": STRING, "at": INT, "cause": STRING,
    "microsteps": _list(_object({"transitions": INTS, "exited": STRINGS, "entered": STRINGS})),
    "trace": STRINGS, "active": STRINGS,
}))  # fmt: skip
RUN: Schema = {
    "anyOf": [
        _object({
            "chart": STRING, "steps": STEPS, "active": STRINGS, "data": _map(VALUE),
            "finished": BOOL, "fault": _or_null(STRING),
        }),
        _object({
            "system": STRING, "now": INT, "steps": STEPS, "active": _map(STRINGS),
            "data": _map(_map(VALUE)), "faults": _map(STRING),
        }),
        _object({"chart": STRING, "target?": STRING, "trace": STRINGS}),
    ]
}  # fmt: skip

AT = {"at?": _object(LOCATION)}
TRACED_PROPERTY = _object({
    "model": STRING, "name": STRING, "claim": STRING, "verdict": _or_null(STRING), **AT,
})  # fmt: skip
TRACED = _object({
    "requirements": _list(_object({
        "id": STRING, "text": STRING, "columns": _map(STRING), **AT,
        "status": {"enum": ["verified", "failed", "undecided", "open"]},
        "items": _list(_object({"kind": STRING, "name": STRING, "covered?": BOOL, **AT})),
        "properties": _list(TRACED_PROPERTY),
        "tests": _list(_object({"file": STRING, "case": STRING, "passed": BOOL, **AT})),
        "coverage": _or_null(_object({"covered": INT, "all": INT})),
        "certificates": _list(_object({
            "file": STRING, "chart": STRING, "target": STRING, "result": STRING,
        })),
    })),
    "counts": _map(INT), "unknown": _list(_object({"id": STRING, **AT})),
    "unrequired": _list(TRACED_PROPERTY), "findings?": FINDINGS,
})  # fmt: skip

HASHES = _map(STRING)
RATIO = _object({"covered": INT, "all": INT})
CERTIFICATE = _object({
    "certificate": INT, "result": {"enum": ["complete", "partial", "different"]},
    "reasons": STRINGS, "chart": STRING, "fingerprint": STRING,
    "sources": _list(_object({"file": STRING, "sha256": STRING})),
    "target": STRING, "compiler": STRING, "command": STRINGS,
    "host": _object({"processor": STRING, "compiler": STRING}),
    "form": STRING, "prefix": _or_null(STRING), "parameters": _map(STRING),
    "firmware": _or_null(_object({"file": STRING, "sha256": STRING})),
    "generated": HASHES, "objects": HASHES,
    "states": INT, "states_left": INT, "steps": INT, "interpreted": INT,
    "emulated": _or_null(INT), "repeated": INT,
    "classes": INT, "limit": INT,
    "coverage": _object(dict.fromkeys(("states", "transitions", "pairs"), RATIO)),
    "maxima": _list(_object({
        "step": STRING, "instructions": INT, "stack": INT, "cycles": _or_null(INT),
        "path": STRINGS,
    })),
    "differences": _list(_object({"step": STRING, "path": STRINGS, "what": STRING})),
    "assumptions": STRINGS, "versions": _map(STRING), "seconds": _map(NUMBER), "sha256": STRING,
})  # fmt: skip

RULE_KEYS = {"code": STRING, "name": STRING, "severity": STRING}
RATIOS = dict.fromkeys(("states", "transitions", "decisions", "conditions"), RATIO)
SUFFIXES = _list(_object({"name": STRING, "suffixes": STRINGS}))
COMPILED = {"struct_bytes": _or_null(INT), "capacities": CAPACITIES}

RESULTS: Mapping[str, Schema] = {
    "bind": _object({
        "binding": STRING, "file": _or_null(STRING), "bound": INT, "header": _map(INT),
        "findings": FINDINGS,
    }),
    "cache": _object({
        "folder": STRING, "bytes": INT, "limit": INT, "removed": STRINGS,
        "entries": _list(_object({"name": STRING, "bytes": INT, "used": NUMBER})),
    }),
    "campaign": _object({
        "campaign": STRING, "verdict": STRING, "jobs": _list(_map(VALUE)), "counts": _map(INT),
        "missing": INT,
    }),
    "certify": {
        "anyOf": [
            CERTIFICATE,
            _object({"certificate": STRING, "result": STRING, "changed": STRINGS}),
        ]
    },
    "check": CHECK,
    "compile": _object({
        "files": STRINGS, **COMPILED, "machines": _list(_object({"name": STRING, **COMPILED})),
        "findings": FINDINGS, "buses?": VALUE,
    }),
    "conformance": {
        **_object({
            "charts?": _map(INT), "meaning?": _map(VALUE),
            "tests": _list(_object({
                "name": STRING, "target?": STRING, "result": STRING, "reason?": STRING,
                "read?": BOOL, "chart?": BOOL, "compiled?": BOOL, "warnings?": INT,
                "replaced?": STRINGS,
            })),
        }),
        "additionalProperties": INT,
    },
    "convert": {"anyOf": [
        _object({"files": STRINGS, "report?": IMPORT}),
        _object({"text": STRING, "report?": IMPORT}),
    ]},
    "cover": CHECK,
    "coverage": _object({
        "charts": _list(_object({
            "chart": STRING, "file": STRING, "percent": _or_null(NUMBER), **RATIOS,
            "missing": STRINGS,
        })),
        "percent": _or_null(NUMBER), "out_of_reach?": VALUE, "lost?": STRINGS, "won?": STRINGS,
    }),
    "dap": _object({"port": INT}),
    "deploy": FILES,
    "diff": _object({
        "old": STRING, "new": STRING, "differences": _list(_object({
            "change": {"enum": ["added", "removed", "moved", "changed", "renamed"]},
            "what": STRING, "name": STRING,
            "details": _list(_object({"key": STRING, "old": VALUE, "new": VALUE})),
            "old_at?": _object(LOCATION), "new_at?": _object(LOCATION),
        })), "files?": STRINGS,
    }),
    "mcp": _object({
        "tools": _list(_object({"name": STRING, "description": STRING, "input": VALUE})),
    }),
    "merge": _object({
        "merged": BOOL, "by": {"enum": ["meaning", "lines"]}, "conflicts": FINDINGS,
        "findings": FINDINGS, "files": STRINGS, "text?": STRING,
    }),
    "check-certificate": {"anyOf": [
        _object({
            "accepted": {"const": True}, "system": STRING, "options": _map(VALUE),
            "covered": _list(STRINGS), "not_covered": _list(STRINGS), "states": INT,
            "local_states": INT, "steps": INT, "seconds": NUMBER,
        }),
        _object({"accepted": {"const": False}, "reason": STRING, "seconds?": NUMBER}),
    ]},
    "draw": _object({"chart": STRING, "files?": STRINGS, "dot?": STRING}),
    "evidence": _object({
        "model": STRING, "failures": STRINGS, "verdict": VERDICT,
        "tests": _object({"passed": INT, "all": INT, "coverage": _object(RATIOS)}),
        "mutants": _or_null(MUTANTS),
        "machines": _list(_object({
            "name": STRING, "file": STRING, "certificate": _or_null(CERTIFICATE),
            "reason": STRING, "alarms": _or_null(STRINGS), "deviations": _or_null(_map(INT)),
        })),
        "requirements": _or_null(TRACED), "findings": FINDINGS, "files": STRINGS,
    }),
    "explain": {
        "anyOf": [_object({**RULE_KEYS, "explanation": STRING}), _list(_object(RULE_KEYS))]
    },
    "export": EXPORT,
    "fmt": _object({"changed": STRINGS, "files": INT, "findings": FINDINGS}),
    "health": _object({"nodes": _list(_object({
        "node": STRING, "endpoint": STRING, "ok": BOOL, "status": STRING, "report": _map(VALUE),
    }))}),
    "io": _object({"signals": _list(_object({
        "name": STRING, "kind": STRING, "number": INT, "raw": INT, "means": _or_null(STRING),
    }))}),
    "latency": _object({"reports": _list(_object({
        "name": STRING, "cycles": INT, "late_ns": _map(NUMBER), "worst_ns": NUMBER,
        "overruns": _or_null(INT), "reasons": _map(INT),
    }))}),
    "lsp": _object({"port": INT}),
    "mutants": MUTANTS,
    "new": FILES,
    "paths": _map(_or_null(STRING)),
    "refine": REFINE,
    "run": RUN,
    "schema": {"anyOf": [_object({"kinds": _map(STRING)}), _object({"file": STRING})]},
    "edit": _object({"name": STRING, "session": STRING, "address": STRING}),
    "serve": _object({"name": STRING, "session": STRING, "address": STRING, "dap?": INT}),
    "show": {"anyOf": [_object(CHART_KEYS), SYSTEM]},
    "simulate": _object({
        "name": STRING, "file": STRING, "machines": INT, "scenarios": INT, "bytes": INT,
    }),
    "targets": _object({
        "targets": _list(_object({"name": STRING, "summary": STRING})), "notations": SUFFIXES,
        "read": SUFFIXES, "drawings": SUFFIXES,
    }),
    "test": _object({
        "cases": _list(_object({
            "file": STRING, "case": STRING, "target": STRING, "passed": BOOL,
            "failures": _list(_object({"at": STRING, "message": STRING})),
        })),
        "coverage?": _object(RATIOS),
    }),
    "trace-requirements": TRACED,
    "trace": {**_object({"trace": STRINGS, "parted": _list(VALUE)}), "additionalProperties": INT},
}  # fmt: skip
"""The schema of the document of each verb; unusable input gives `ERROR` instead."""


def result_schema(verb: str) -> Schema:
    """Return the schema of the document that ``fsmkit VERB --json`` prints."""
    title = f"The output of fsmkit {verb} --json"
    return {"title": title, "anyOf": [RESULTS[verb], ERROR]}
