"""The text of a state diagram of Mermaid: states within states, arrows, descriptions."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from fsmkit.diagnostics import Findings, Source, Span, Text

HEADER = re.compile(r"stateDiagram(?:-v2)?\s*(?:\\n)?\s*;?$")
TITLE = re.compile(r"title:\s*(.*)$")
KIND = r"(?:<<|\[\[|&lt;&lt;)\s*(\w+)\s*(?:>>|\]\]|&gt;&gt;)"
STATE = re.compile(
    rf"state\s+(?:\"(?P<title>[^\"]*)\"\s+as\s+(?P<named>[^\s:{{]+)|(?P<id>[^\s:{{\"]+)|\"(?P<only>[^\"]*)\")"
    rf"\s*(?:{KIND})?\s*(?P<style>:::[\w,-]+)?\s*(?P<open>\{{)?\s*(?::\s*(?P<text>.*))?$",
    re.IGNORECASE,
)
END = r"(\[\*\]|[^\s:{}<>]+?)(?::::[\w,-]+)?"
ARROW = re.compile(rf"{END}\s*-->\s*{END}\s*(?::\s*(.*))?$")
ALONE = re.compile(r"([^\s:{}<>-]+(?:-[^\s:{}<>-]+)*)(?::::[\w,-]+)?(\s*\{)?$")
DESCRIBED = re.compile(r"([^\s:{}<>]+)\s*:(?!::)\s*(.*)$")
SETTING = re.compile(
    r"(?:direction|classDef|style|click|accTitle|accDescr|scale|hide|title|%%|href)\b|%%",
    re.IGNORECASE,
)
CLASS = re.compile(r"class\s+([^\s]+(?:\s*,\s*[^\s]+)*)\s+([\w-]+)\s*;?$")
NOTE = re.compile(
    r"note\s+(?:\"[^\"]*\"\s+as\s+\S+|(?:right|left)\s+of\s+(\S+?)\s*(:.*)?)$", re.IGNORECASE
)
COMMENT = re.compile(r"\s%%.*$")
ENTITY = re.compile(r"#(\d{1,7});|&(lt|gt|amp|quot|nbsp);")
NAMED = {"lt": "<", "gt": ">", "amp": "&", "quot": '"', "nbsp": " "}
BREAK = re.compile(r"<br\s*/?>|\\n", re.IGNORECASE)
DEEPEST = 60
LONGEST = 4_096
"""Characters of a line."""


@dataclass(eq=False)
class Node:
    """A state. ``sections`` are the regions, between lines ``--``, each with its states."""

    key: str
    at: Text
    kind: str = "state"
    title: str = ""
    lines: list[Text] = field(default_factory=list)
    notes: list[Text] = field(default_factory=list)
    sections: list[list[Node]] = field(default_factory=lambda: [[]])
    starts: list[tuple[int, Arrow]] = field(default_factory=list)
    """Arrows from ``[*]``, each with the number of its section."""
    parent: Node | None = None

    @property
    def children(self) -> list[Node]:
        """Return the states in all sections."""
        return [child for section in self.sections for child in section]


@dataclass(frozen=True, slots=True)
class Arrow:
    """An arrow; ``target`` None: to ``[*]``."""

    source: Node
    target: Node | None
    label: Text | None
    span: Span


@dataclass
class Diagram:
    """A whole diagram: the nameless root, and all arrows between states."""

    root: Node
    name: Text
    arrows: list[Arrow] = field(default_factory=list)
    histories: set[str] = field(default_factory=set)
    lost: list[Span] = field(default_factory=list)


def read_diagram(source: Source, findings: Findings) -> Diagram | None:
    """Return the diagram of a file, or None if it is not a state diagram."""
    reader = _Reader(source, findings)
    reader.read()
    if not reader.has_header:
        findings.add(
            "foreign-syntax", "the file is not a state diagram of Mermaid", Span(source, 0, 1),
            help="write `stateDiagram-v2` in the first line",
        )  # fmt: skip
        return None
    return reader.diagram


class _Reader:
    def __init__(self, source: Source, findings: Findings) -> None:
        self.source, self.findings = source, findings
        whole = Text("Machine", Span(source, 0, 0), ())
        self.diagram = Diagram(Node("", whole), whole)
        self.scopes = [self.diagram.root]
        self.nodes: dict[str, Node] = {}
        self.declared: set[str] = set()
        self.has_header = False
        self.last: Node | None = None
        """The state that the previous line declared: a brace may follow on a line of its own."""

    def read(self) -> None:
        """Read all lines."""
        place, until, note = 0, "", None
        for raw in self.source.text.split("\n"):
            value = raw.strip()
            at = place + len(raw) - len(raw.lstrip())
            line = Text(value, Span(self.source, at, at + len(value)))
            place += len(raw) + 1
            if until:
                if value.lower() == until:
                    until, note = "", None
                elif note is not None:
                    note.notes.append(line)
                elif (found := TITLE.match(value)) and until == "---":
                    self.diagram.name = line.with_value(_quoted(found[1]))
            elif not self.has_header and value == "---":
                until = "---"
            elif not value or value.startswith("%%"):
                continue
            elif not self.has_header:
                self.has_header = HEADER.match(value) is not None
                if not self.has_header:
                    return
            elif len(value) > LONGEST:
                self._syntax(f"the line has more than {LONGEST} characters", line)
            elif match := NOTE.match(value):
                note = None if match[1] is None else self._node(match[1], line)
                if match[1] is not None and match[2] is None:
                    until = "end note"
                elif note is not None:
                    note.notes.append(line.part(match.start(2) + 1, match.end(2)).strip())
            elif value.lower().startswith("accdescr") and value.endswith("{"):
                until = "}"
            elif match := CLASS.match(value):
                names = re.split(r"\s*,\s*", match[1])
                self.diagram.histories |= set(names) if match[2] == "history" else set()
            elif SETTING.match(value) and "-->" not in value:
                self.diagram.lost.append(line.span)
            else:
                self._line(line)
        if len(self.scopes) > 1:
            self._syntax(f"`{self.scopes[-1].key}` is not closed", self.scopes[-1].at)

    def _line(self, line: Text) -> None:
        value = COMMENT.sub("", line.value)
        value = value if value.endswith("&gt;") else value.rstrip("; ")
        if value == "{" and self.last is not None:
            self._open(self.last, line)
        elif value == "}":
            if len(self.scopes) > 1:
                self.scopes.pop()
            else:
                self._syntax("a `}` closes nothing", line)
        elif value == "--":
            self.scopes[-1].sections.append([])
        elif match := STATE.match(value):
            self._state(line, match)
        elif "-->" in value and (match := ARROW.match(value)):
            self._arrow(line, match)
        elif match := ALONE.match(value):
            node = self._node(match[1], line)
            if match[2]:
                self._open(node, line)
        elif match := DESCRIBED.match(value):
            node = self._node(match[1], line)
            node.lines.append(line.part(match.start(2), match.end(2)))
        else:
            self._syntax(f"`{value[:60]}` is not read", line)

    def _state(self, line: Text, match: re.Match[str]) -> None:
        name = match["named"] or match["id"] or match["only"].replace(" ", "_")
        node = self._node(name, line, is_declared=True)
        node.title = plain(match["title"] or match["only"] or "") or node.title
        kind = match[5]
        if kind is not None:
            if kind.lower() in ("fork", "join", "choice"):
                node.kind = kind.lower()
            else:
                self._syntax(f"there is no state `<<{kind}>>`", line)
        if match["text"]:
            node.lines.append(line.part(match.start("text"), match.end("text")))
        self.last = node
        if match["open"]:
            self._open(node, line)

    def _open(self, node: Node, line: Text) -> None:
        if node in self.scopes or len(self.scopes) >= DEEPEST:
            self._syntax(f"`{node.key}` is inside itself, or too deep", line)
        self.scopes.append(node)

    def _arrow(self, line: Text, match: re.Match[str]) -> None:
        scope = self.scopes[-1]
        label = None
        if match[3]:
            label = line.part(match.start(3), match.start(3) + len(match[3].rstrip("; ")))
        target = None if match[2] == "[*]" else self._node(match[2], line)
        if match[1] != "[*]":
            source = self._node(match[1], line)
            self.diagram.arrows.append(Arrow(source, target, label, line.span))
        elif target is None:
            self._syntax("an arrow leads from `[*]` to `[*]`", line)
        else:
            arrow = Arrow(scope, target, label, line.span)
            scope.starts.append((len(scope.sections) - 1, arrow))

    def _node(self, key: str, line: Text, *, is_declared: bool = False) -> Node:
        """Return the state of a key; it is in the scope that declares it, or names it first."""
        scope = self.scopes[-1]
        if key not in self.nodes:
            self.nodes[key] = Node(key, line.with_value(key), parent=scope)
            scope.sections[-1].append(self.nodes[key])
        node = self.nodes[key]
        if is_declared and node not in self.scopes and key not in self.declared:
            self.declared.add(key)
            for section in () if node.parent is None else node.parent.sections:
                section[:] = [each for each in section if each is not node]
            node.parent = scope
            scope.sections[-1].append(node)
        return node

    def _syntax(self, message: str, at: Text) -> None:
        self.findings.add("foreign-syntax", message, at, help="correct the line, or remove it")


def plain(text: str) -> str:
    """Return a text without entities; breaks become new lines."""
    return ENTITY.sub(_entity, BREAK.sub("\n", text))


def _entity(match: re.Match[str]) -> str:
    if match[2]:
        return NAMED[match[2]]
    number = int(match[1])
    return chr(number) if 0 < number < 0x110000 and not 0xD800 <= number < 0xE000 else "?"


def _quoted(text: str) -> str:
    """Return a title of the front matter, which is YAML."""
    if len(text) > 1 and text[0] == text[-1] == '"':
        text = re.sub(r"\\x([0-9a-fA-F]{2})", lambda match: chr(int(match[1], 16)), text[1:-1])
    return text.strip() or "Machine"
