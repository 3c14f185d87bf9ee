"""State diagrams of PlantUML, as far as StateSmith reads them."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from fsmkit.diagnostics import Findings, Source, Span, Text
from fsmkit.foreign.imports import reject
from fsmkit.foreign.statesmith.graph import Diagram, Edge, Node, joined

START = re.compile(r"@startuml(?:[^\S\n]+([^\n]*?))?[^\S\n]*(?:\n|\Z)")
REFERENCE = r"\[\*\]|\w+\[H\*?\]|\[H\*?\]|[\w.]+"
ARROW = re.compile(
    rf"({REFERENCE})\s*(?:<<[^>\n]*>>\s*)?(-+(?!-)(?:\[[^\]\n]*\])?\w*(?:\[[^\]\n]*\])?-*>|<\w*-+)"
    rf"\s*({REFERENCE})\s*(?:<<[^>\n]*>>\s*)?(?::(.*))?$"
)
STATE = re.compile(
    r"state\s+(?:\"([^\"\n]*)\"\s+as\s+([\w.]+)|([\w.]+)\s+as\s+\"([^\"\n]*)\"|([\w.]+)|\"(\w+)\")"
    r"\s*((?:<<[^>\n]*>>|#[^\s{:]*|\[\[[^\]\n]*\]\])?(?:\s*(?:<<[^>\n]*>>|#[^\s{:]*))*)\s*"
    r"(?::(.*)|(\{))?$",
    re.IGNORECASE,
)
LINE = re.compile(r"([\w.]+)\s*:(.*)$")
NOTE = re.compile(r"note\b", re.IGNORECASE)
ONE_LINE_NOTE = re.compile(r"note\s+(?:\"[^\"\n]*\"\s+as\s+\w+|[^:\n]*:.*)$", re.IGNORECASE)
SETTING = re.compile(
    r"(?:skinparam|hide|show|scale|title|caption|header|footer|left\s+to\s+right|top\s+to\s+bottom"
    r"|!theme|!pragma|remove|mainframe|allow_?mixing|autonumber)\b",
    re.IGNORECASE,
)
BLOCK = re.compile(r"(legend|header|footer|title)\s*(?:left|right|center)?$", re.IGNORECASE)
KINDS = {
    "choice": "choice",
    "entrypoint": "entry",
    "exitpoint": "exit",
    "history": "history",
    "history*": "deep",
}
BEYOND = ("fork", "join", "end", "expansioninput", "expansionoutput", "inputpin", "outputpin")
DEEPEST = 60


@dataclass
class _Reader:
    source: Source
    findings: Findings
    diagram: Diagram
    scopes: list[Node]
    nodes: dict[str, Node] = field(default_factory=dict)
    homes: dict[str, Node] = field(default_factory=dict)
    behaviours: dict[str, list[Text]] = field(default_factory=dict)
    declared: set[str] = field(default_factory=set)

    def line(self, line: Text) -> None:
        """Read one line that is neither a setting nor a note."""
        value = line.value
        if value == "}":
            if len(self.scopes) > 1:
                self.scopes.pop()
            else:
                self._syntax("a `}` closes nothing", line, "remove it")
        elif match := STATE.match(value):
            self._state(line, match)
        elif match := ARROW.match(value):
            self._arrow(line, match)
        elif match := LINE.match(value):
            node = self._node(match[1], line)
            self._behaviour(node, line, match.start(2), match.end(2))
        elif set(value) in ({"-"}, {"|"}) and len(value) > 1:
            reject(
                self.findings,
                "a state has regions, which StateSmith does not read",
                line,
                "give each region a diagram of its own",
            )
        else:
            self._syntax(f"`{value[:60]}` is not read", line, "remove it, or see the syntax page")

    def _state(self, line: Text, match: re.Match[str]) -> None:
        name = match[2] or match[3] or match[5] or match[6]
        node = self._node(name, line)
        home = self.homes[node.key]
        if home is not self.scopes[-1] and node.key not in self.declared:
            if node in self.scopes:
                self._syntax(f"`{name}` is inside itself", line, "rename one of the two")
            else:
                home.children.remove(node)
                self._put(node, self.scopes[-1])
        self.declared.add(node.key)
        for style in re.findall(r"<<\s*([^>\s]*)\s*>>", match[7] or ""):
            node.kind = KINDS.get(style.lower(), node.kind)
            if style.lower() in BEYOND:
                reject(self.findings, f"StateSmith has no state `<<{style}>>`", line, "remove it")
        if match[8] is not None:
            self._behaviour(node, line, match.start(8), match.end(8))
        if match[9] is not None:
            self.scopes.append(node)
            if len(self.scopes) == DEEPEST:
                self._syntax("states are nested too deep", line, f"use {DEEPEST - 2} levels")

    def _arrow(self, line: Text, match: re.Match[str]) -> None:
        source, target = match[1], match[3]
        if match[2].startswith("<"):
            source, target = target, source
        if target == "[*]":
            reject(self.findings, "StateSmith has no final states", line, "use an ordinary state")
            return
        start = self._node(source, line)
        end = self._node(target, line)
        label = Text("", line.span)
        if match[4] is not None:
            label = _unescaped(line.part(match.start(4), match.end(4)).strip())
        self.diagram.edges.append(Edge(start.key, end.key, label, line.span))

    def _behaviour(self, node: Node, line: Text, start: int, end: int) -> None:
        self.behaviours.setdefault(node.key, []).append(_unescaped(line.part(start, end).strip()))

    def _node(self, written: str, line: Text) -> Node:
        """Return the state of a name, or the pseudo state of a scope."""
        name, _, rest = written.partition("[")
        if not rest:
            return self._named(name, "state", self.scopes[-1], line)
        scope = self._named(name, "state", self.scopes[-1], line) if name else self.scopes[-1]
        kind = {"*]": "initial", "H]": "history", "H*]": "deep"}[rest]
        return self._named(f"{scope.key}[{rest}", kind, scope, line)

    def _named(self, key: str, kind: str, scope: Node, line: Text) -> Node:
        if key not in self.nodes:
            place = line.value.find(key)
            label = line.part(max(place, 0), max(place, 0) + len(key)) if kind == "state" else line
            self.nodes[key] = Node(key, label.with_value(key), line.span, kind)
            self._put(self.nodes[key], scope)
        return self.nodes[key]

    def _put(self, node: Node, scope: Node) -> None:
        scope.children.append(node)
        self.homes[node.key] = scope

    def _syntax(self, message: str, line: Text, fix: str) -> None:
        self.findings.add("foreign-syntax", message, line, help=fix)


def _unescaped(text: Text) -> Text:
    r"""Return a label in which ``\n`` is a new line."""
    if "\\n" not in text.value:
        return text
    value, kept, at = "", [], 0
    offsets = list(text.character_offsets())
    for match in re.finditer(r"\\n", text.value):
        value += text.value[at : match.start()] + "\n"
        kept += offsets[at : match.start() + 1]
        at = match.end()
    return Text(value + text.value[at:], text.span, tuple(kept + offsets[at:]))


def _without_comments(text: str) -> str:
    """Return a text with blanks in place of comments."""
    parts, at = [], 0
    while (start := text.find("/'", at)) >= 0 and (end := text.find("'/", start + 2)) >= 0:
        parts += [text[at:start], re.sub(r"[^\n]", " ", text[start : end + 2])]
        at = end + 2
    lines = "".join([*parts, text[at:]]).split("\n")
    return "\n".join(" " * len(one) if one.lstrip()[:1] == "'" else one for one in lines)


def diagrams(source: Source) -> list[tuple[str, int, int]]:
    """Return the name and the range of each diagram in a file."""
    found = []
    for number, match in enumerate(START.finditer(source.text), 1):
        end = source.text.find("@enduml", match.end())
        name = match[1] or (_stem(source.name) if number == 1 else f"diagram_{number}")
        found.append((name, match.end(), len(source.text) if end < 0 else end))
    return found


def _stem(name: str) -> str:
    return name.replace("\\", "/").rsplit("/", 1)[-1].split(".")[0] or "Machine"


def read_plantuml(source: Source, name: str, findings: Findings) -> Diagram | None:
    """Return the diagram of that name in a file."""
    ranges = {found: (start, end) for found, start, end in reversed(diagrams(source))}
    start, end = ranges[name]
    plain = _without_comments(source.text[start:end])
    whole = Span(source, start, start)
    machine = Node("", Text(f"$STATEMACHINE : {name}", whole, ()), whole, "machine")
    reader = _Reader(source, findings, Diagram(), [machine])
    skipped = ""
    depth = 0
    place = start
    for raw in plain.split("\n"):
        value = raw.strip()
        at = place + len(raw) - len(raw.lstrip())
        line = Text(value, Span(source, at, at + len(value)))
        place += len(raw) + 1
        if depth:
            depth += value.count("{") - value.count("}")
        elif skipped:
            skipped = "" if value.lower().replace(" ", "").startswith(skipped) else skipped
        elif NOTE.match(value):
            reader.diagram.lost.append(("a note", line.span))
            skipped = "" if ONE_LINE_NOTE.match(value) else "endnote"
        elif match := BLOCK.match(value):
            skipped = f"end{match[1].lower()}"
        elif SETTING.match(value):
            reader.diagram.lost.append(("a setting of the drawing", line.span))
            depth = value.count("{") - value.count("}")
        elif value:
            reader.line(line)
    if len(reader.scopes) > 1:
        open_ = reader.scopes[-1]
        findings.add(
            "foreign-syntax", f"`{open_.key}` is not closed", open_.span, help="write `}` below it"
        )
    for key, lines in reader.behaviours.items():
        reader.nodes[key].label = joined(reader.nodes[key].label, lines)
    page = Node("", Text(name, whole, ()), whole, children=[machine])
    reader.diagram.pages.append(page)
    return reader.diagram
