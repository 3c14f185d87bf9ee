"""The schemas of systems and deployments."""

from __future__ import annotations

from fsmkit.document import keys
from fsmkit.editor.schemas.shapes import (
    FLAG,
    NAMES,
    TEXT,
    TEXTS,
    Schema,
    either,
    record,
    record_of,
    table,
)
from fsmkit.system.deployment.keys import foreign_keys, link_keys, node_keys
from fsmkit.system.properties.kinds import kinds


def system_schema() -> Schema:
    """Return the schema of a system."""
    machine = record(keys.MACHINE, {"with": table(TEXT), "start": table(TEXT)}, required=["chart"])
    options = record(keys.CONNECTION, {"kind": {"enum": ["direct", "queued", "lossy"]}})
    connection = either(
        TEXT, {"type": "object", "additionalProperties": options, "maxProperties": 1}
    )
    freeze = record(keys.FREEZE, {"machines": TEXTS, "silent": TEXTS}, required=["machines"])
    environment = record(
        keys.ENVIRONMENT, {**dict.fromkeys(keys.ENVIRONMENT, TEXTS), "freezes": table(freeze)}
    )
    schedule = record(keys.SCHEDULE, {"cyclic": TEXTS}, required=["cyclic", "period"])
    special: dict[str, Schema] = {
        "req": NAMES,
        "parameters": table(TEXT),
        "machines": table(either(TEXT, machine)),
        "shared": table(TEXT),
        "connect": {"type": ["array", "null"], "items": connection},
        "environment": {**environment, "type": ["object", "null"]},
        "schedule": schedule,
        "properties": table(_property()),
    }
    return {
        "title": "A system of machines of fsmkit",
        **record(keys.SYSTEM, special, required=["system", "machines"]),
    }


def _property() -> Schema:
    """Return the schema of a property: a kind, or a kind with its conditions."""
    words = [kind.key for kind in kinds().values() if not kind.form]
    forms: list[Schema] = [{"enum": words}]
    for kind in kinds().values():
        if kind.read is not None:
            monitor = either(
                TEXT, record(keys.MACHINE, {"with": table(TEXT), "start": table(TEXT)})
            )
            watch = either(TEXT, TEXTS, table(TEXT))
            forms.append(record(keys.MONITOR, {"monitor": monitor, "watch": watch, "req": NAMES}))
        else:
            value: Schema = TEXT if kind.form else FLAG
            if len(kind.form) > 1:
                count = len(kind.form)
                value = {"type": "array", "items": TEXT, "minItems": count, "maxItems": count}
            forms.append({
                "type": "object",
                "properties": {kind.key: value, "req": NAMES},
                "required": [kind.key],
                "additionalProperties": False,
            })  # fmt: skip
    return either(*forms)


def deployment_schema() -> Schema:
    """Return the schema of a deployment."""
    kinds = foreign_keys()
    node = either(TEXTS, record(node_keys(), {"machines": TEXTS, "foreign": {"enum": [*kinds]}}))
    foreign = either(*(record_of(rows) for rows in kinds.values()))
    links = record_of(link_keys(), {"foreign": table(foreign)})
    special: dict[str, Schema] = {
        "nodes": table(node),
        "links": {**links, "type": ["object", "null"]},
        "health": table(TEXT),
    }
    return {
        "title": "A deployment of a system of fsmkit",
        **record(keys.DEPLOYMENT, special, required=["system", "nodes"]),
    }
