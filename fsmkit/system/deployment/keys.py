"""The keys of deployment files: those common to all carriers, and those of each carrier."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from fsmkit.document.keys import ADDRESS_KEYS, LINKS, NODE, Key, Keys
from fsmkit.system.deployment.carrier import DEFAULT, foreign_carriers, link_carriers

_LAST = ("watchdog", "foreign")


def link_keys() -> Keys:
    """Return the keys of `links`, in their usual order."""
    carriers = link_carriers()
    others = " or ".join(name for name in carriers if name != DEFAULT)
    kind = replace(LINKS["kind"], doc=f"{LINKS['kind'].doc}: {DEFAULT}, unless it says {others}")
    own: dict[str, Key] = {}
    for name, carrier in carriers.items():
        for key, row in carrier.link_keys.items():
            if key not in ADDRESS_KEYS:
                before = f"{own[key].doc}; " if key in own else ""
                own[key] = replace(row, doc=f"{before}of the kind {name}: {row.doc}")
    first = {key: row for key, row in LINKS.items() if key not in _LAST}
    last = {key: LINKS[key] for key in _LAST}
    return {**first, "kind": kind, **own, **last}


def node_keys() -> Keys:
    """Return the keys of a node."""
    kinds = " or ".join(foreign_carriers())
    return {**NODE, "foreign": replace(NODE["foreign"], doc=f"{NODE['foreign'].doc}: {kinds}")}


def foreign_keys() -> Mapping[str, Keys]:
    """Return the keys of a foreign node in `links: {foreign: ...}`, by its kind."""
    return {name: carrier.foreign_keys for name, carrier in foreign_carriers().items()}
