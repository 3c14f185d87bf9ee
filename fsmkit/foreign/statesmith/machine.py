"""From a diagram to the states and behaviours of a machine of StateSmith."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.foreign.imports import reject
from fsmkit.foreign.statesmith.graph import Diagram, Edge, Node
from fsmkit.foreign.statesmith.labels import UNORDERED, Behaviour, read_behaviours, skip

MACHINE = re.compile(r"\$STATEMACHINE\s*:\s*(.*?)\s*(?:\n|$)", re.IGNORECASE)
SPECIAL = re.compile(r"\$\s?(\w+)\s*(?::\s*([^\n]*))?")
POINT = re.compile(r"(entry|exit)\s*:\s*(\w+)\s*$", re.IGNORECASE)
NAME = re.compile(r"[^\W\d]\w*")
MODIFIER = re.compile(r"\$mod\s*/\s*(\{[^}]*\}|[^\n]*)\n?", re.IGNORECASE)
PREFIX = re.compile(r"prefix\s*\.\s*(auto|add|set)\s*\(\s*(\w*)\s*\)")
KINDS = {
    "initial_state": "initial",
    "choice": "choice",
    "h": "history",
    "hc": "continued",
    "parent_alias": "alias",
    "notes": "notes",
    "config": "config",
    "renderconfig": "config",
    "mod": "mod",
}
PSEUDO = ("initial", "choice", "history", "deep", "entry", "exit")
"""Kinds that are left as soon as they are entered."""
IGNORED = ("notes", "config")


@dataclass
class Vertex:
    """A state or pseudo state. ``name`` of an entry, exit or choice is that of the point."""

    key: str
    kind: str
    name: str
    at: Text
    children: list[Vertex] = field(default_factory=list)
    behaviours: list[Behaviour] = field(default_factory=list)
    prefix: str | None = None
    """The part that it adds to the names of states in it."""

    def walk(self) -> Iterator[Vertex]:
        """Yield this vertex and those in it, in order."""
        yield self
        for child in self.children:
            yield from child.walk()


def machine_nodes(diagram: Diagram) -> dict[str, tuple[Node, Node]]:
    """Return the nodes of machines by name, each with its page.

    In a file without ``$STATEMACHINE``, each group around an initial state is a machine.
    """
    found: dict[str, tuple[Node, Node]] = {}
    for page in diagram.pages:
        for node in page.children:
            match = MACHINE.match(node.label.value.strip())
            if match is not None:
                found.setdefault(match[1] or "Machine", (node, page))
    if not found:
        for page in diagram.pages:
            for node in page.children:
                if any(child.label.value.strip() == "$initial_state" for child in node.children):
                    found.setdefault(node.label.value.strip().split("\n")[0], (node, page))
    return found


@dataclass
class MachineReader:
    """Reads one machine of a diagram."""

    diagram: Diagram
    findings: Findings
    vertices: dict[str, Vertex] = field(default_factory=dict)
    parents: dict[str, Vertex] = field(default_factory=dict)
    aliases: dict[str, str] = field(default_factory=dict)
    """Keys of aliases, with the keys of the states that they represent."""
    ignored: set[str] = field(default_factory=set)
    trigger_map: list[tuple[str, str]] = field(default_factory=list)
    lost: list[tuple[str, Span]] = field(default_factory=list)
    variables: list[Text] = field(default_factory=list)
    """Declarations of variables in the configuration of the diagram."""

    def read(self, node: Node, page: Node) -> Vertex:
        """Return the root of the machine at a node."""
        others = [other for other in page.children if other is not node]
        children = node.children or [
            other for other in others if not MACHINE.match(other.label.value.strip())
        ]
        for other in others:
            self._config(other)
        match = MACHINE.match(node.label.value.strip())
        name = (
            match[1] if match is not None else node.label.value.strip().split("\n")[0]
        ) or "Machine"
        root = Vertex(node.key, "root", name, node.label)
        self.vertices[node.key] = root
        start = node.label.value.find("\n")
        if match is not None and start >= 0:
            self._behaviours(root, node.label.part(start, len(node.label.value)))
        for child in children:
            self._vertex(child, root)
        self._alias()
        machine = set(self.vertices) | set(self.aliases) | self.ignored
        for edge in self.diagram.edges:
            self._edge(edge, machine)
        self._vias()
        return root

    # --- shapes -------------------------------------------------------------------------------

    def _config(self, node: Node) -> None:
        """Read the parts of a configuration that have a meaning: names of triggers, variables."""
        label = node.label.value.strip()
        match = SPECIAL.match(label)
        if match is None or KINDS.get(match[1].lower()) != "config":
            return
        what = (match[2] or "").strip().lower()
        start = node.label.value.find("\n")
        if start >= 0 and what == "triggermap":
            for line in re.sub(r"/\*.*?\*/", "", node.label.value[start:]).splitlines():
                left, arrow, right = line.partition("//")[0].partition("=>")
                if arrow:
                    self.trigger_map.append((left.strip(), right.strip()))
        elif start >= 0 and what in ("variabledeclarations", "autoexpandedvars"):
            self.variables.append(node.label.part(start, len(node.label.value)))
        for child in node.children:
            self._config(child)

    def _vertex(self, node: Node, parent: Vertex) -> None:
        """Add the vertex of a node, and those in it."""
        label = node.label
        lead = len(label.value) - len(label.value.lstrip())
        value = label.value[lead:]
        match = SPECIAL.match(value)
        kind, name, start = node.kind, "", 0
        if MACHINE.match(value):
            reject(
                self.findings, "a machine inside of a machine is not read", node.span,
                "import each machine separately",
            )  # fmt: skip
            self._ignore(node)
            return
        if match is not None and kind in ("", "state"):
            kind, name, start = KINDS.get(match[1].lower(), "?"), match[2] or "", match.end()
            if kind == "mod":
                kind, start = "?", 0
        elif point := POINT.match(value.split("\n")[0]):
            kind, name, start = point[1].lower(), point[2], point.end()
        elif kind in ("", "state") and (word := NAME.match(value)):
            kind, name, start = "state", word[0], word.end()
        elif kind in ("entry", "exit", "choice") and (word := NAME.match(value)):
            name, start = word[0], word.end()
        elif kind:
            start = len(value.split("\n")[0]) if kind != "state" else 0
        elif not value.strip() and not node.children and not self._has_edge(node):
            kind = "notes"
        if kind in IGNORED:
            self._ignore(node)
            if kind == "config":
                self._config(node)
            else:
                self.lost.append(("a note", node.span))
            return
        if not kind or kind == "?" or (kind == "state" and not name):
            shown = value.split("\n")[0][:60]
            self.findings.add(
                "foreign-syntax", f"`{shown}` is not a state", label if value else node.span,
                help="write the name of the state in the first line",
            )  # fmt: skip
            self._ignore(node)
            return
        vertex = Vertex(node.key, kind, name, label.part(lead, lead + start) if start else label)
        self.vertices[node.key] = vertex
        self.parents[node.key] = parent
        parent.children.append(vertex)
        self._behaviours(vertex, label.part(lead + start, len(label.value)))
        for child in node.children:
            self._vertex(child, vertex)

    def _behaviours(self, vertex: Vertex, text: Text) -> None:
        """Read the behaviours below a name; modifiers of names are taken out."""
        at = 0
        while (match := MODIFIER.search(text.value, at)) is not None:
            self._read(vertex, text.part(at, match.start()))
            for how, name in PREFIX.findall(match[1]):
                vertex.prefix = vertex.name if how == "auto" else name
            at = match.end()
        self._read(vertex, text.part(at, len(text.value)))

    def _read(self, vertex: Vertex, text: Text) -> None:
        if skip(text.value, 0) < len(text.value):
            vertex.behaviours += read_behaviours(text, self.findings)

    def _ignore(self, node: Node) -> None:
        self.ignored.add(node.key)
        for child in node.children:
            self._ignore(child)

    def _has_edge(self, node: Node) -> bool:
        return any(node.key in (edge.source, edge.target) for edge in self.diagram.edges)

    def _alias(self) -> None:
        """Merge each alias with the state that it represents."""
        for key, vertex in list(self.vertices.items()):
            if vertex.kind == "alias":
                parent = self.parents[key]
                parent.children.remove(vertex)
                parent.behaviours += vertex.behaviours
                parent.prefix = (vertex.prefix and parent.name) or parent.prefix
                self.aliases[key] = parent.key
                del self.vertices[key]
        for key in self.aliases:
            while self.aliases[key] in self.aliases:
                self.aliases[key] = self.aliases[self.aliases[key]]

    # --- arrows -------------------------------------------------------------------------------

    def _edge(self, edge: Edge, machine: set[str]) -> None:
        """Add the behaviours of an arrow to its source."""
        ends = edge.source, edge.target
        if not any(end in machine for end in ends) and any(ends):
            return  # of another machine, or of notes beside it
        if any(end in self.ignored for end in ends):
            return
        found = [self.vertices.get(self.aliases.get(end, end)) for end in ends]
        source, target = found
        if source is None or target is None or not edge.source or not edge.target:
            which = "starts" if source is None else "ends"
            self.findings.add(
                "foreign-syntax", f"an arrow {which} at nothing, or outside of the machine",
                edge.span, help="connect both ends to states of the machine",
            )  # fmt: skip
            return
        labels = read_behaviours(edge.label, self.findings)
        blank = skip(edge.label.value, 0) == len(edge.label.value)
        if blank:
            labels = [Behaviour((), None, None, UNORDERED, edge.span)]
        source.behaviours += [replace(label, target=target.key) for label in labels]

    def _vias(self) -> None:
        """Let transitions through entry and exit points lead there, and from there."""
        for vertex in list(self.vertices.values()):
            kept: list[Behaviour] = []
            for behaviour in vertex.behaviours:
                led = self._led(behaviour)
                name = dict(behaviour.via).get("exit")
                home = vertex
                if name is not None:
                    point = self._point(vertex, "exit", name, behaviour.span)
                    if point is None:
                        continue
                    home = point
                if led is not None:
                    (kept if home is vertex else home.behaviours).append(led)
            vertex.behaviours = kept

    def _led(self, behaviour: Behaviour) -> Behaviour | None:
        """Return a behaviour that leads to its entry point; None if there is no such point."""
        name = dict(behaviour.via).get("entry")
        if name is None:
            return replace(behaviour, via=())
        target = self.vertices.get(behaviour.target or "")
        point = None if target is None else self._point(target, "entry", name, behaviour.span)
        return None if point is None else replace(behaviour, target=point.key, via=())

    def _point(self, vertex: Vertex, kind: str, name: str, at: Span) -> Vertex | None:
        for child in vertex.children:
            if child.kind == kind and child.name == name:
                return child
        self.findings.add(
            "foreign-syntax",
            f"`{vertex.name}` has no {kind} point `{name}`",
            at,
            help=f"add `{kind} : {name}` inside of it",
        )
        return None
