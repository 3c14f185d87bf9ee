"""From YAML nodes to the states and transitions of a Document."""

from __future__ import annotations

from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.model.declaration_text import read_typed
from fsmkit.model.document import (
    Block,
    DocArgument,
    DocData,
    DocInvoke,
    DocState,
    DocTransition,
    Kind,
    Trigger,
)
from fsmkit.model.statement_text import read_statements
from fsmkit.yaml import keys
from fsmkit.yaml.nodes import (
    Mapping,
    Node,
    Scalar,
    Sequence,
    check_keys,
    demand_mapping,
    demand_text,
)

HISTORIES = {"shallow": Kind.SHALLOW_HISTORY, "deep": Kind.DEEP_HISTORY}


class StateReader:
    """Reads states; what is wrong goes to the findings, and the rest is still read."""

    def __init__(self, findings: Findings) -> None:
        """Tell findings to this collector."""
        self._findings = findings

    # --- small values ---------------------------------------------------------------------

    def flag(self, node: Node | None, what: str) -> bool:
        """Read ``true`` or ``false``; absent is false."""
        if node is None:
            return False
        text = demand_text(node, f"`{what}`", self._findings)
        if text is not None and text.value not in ("true", "false"):
            self._findings.add(
                "unexpected-value", f"`{what}` is `true` or `false`, not `{text.value}`", text,
                help="write `true` or leave the key out",
            )  # fmt: skip
        return text is not None and text.value == "true"

    def names(self, node: Node | None, what: str) -> tuple[Text, ...]:
        """Read a name or a list of names; spaces separate names too."""
        match node:
            case None:
                return ()
            case Sequence():
                return tuple(name for item in node.items for name in self.names(item, what))
            case _:
                text = demand_text(node, what, self._findings)
                return () if text is None else words(text)

    def blocks(self, node: Node | None) -> tuple[Block, ...]:
        """Read handlers: one text is one, a list has one for each text."""
        match node:
            case None:
                return ()
            case Sequence():
                return tuple(block for item in node.items for block in self.blocks(item))
            case Mapping():
                self._lost_statement(node)
                return ()
            case _:
                return (self._statements(node),) if node.text.value.strip() else ()

    def block(self, node: Node | None) -> Block | None:
        """Read one handler; a list of texts is one all the same."""
        if node is None:
            return None
        return tuple(statement for block in self.blocks(node) for statement in block)

    def _statements(self, node: Scalar) -> Block:
        end = node.span.source.text[node.span.end :].split("\n", 1)[0]
        if not node.quoted and end.strip().startswith("#"):
            word = end.strip().removeprefix("#")[:1]
            if word and not word.isspace():
                lost = f"{node.text.value} {end.strip()}"
                self._findings.add(
                    "comment-in-statement", "YAML takes ` #` for the start of a comment", node.span,
                    help=f"if it belongs to the statement, quote the text: '{lost}'",
                )  # fmt: skip
        return read_statements(node.text, self._findings)

    def _lost_statement(self, node: Mapping) -> None:
        written = node.span.source.text[node.span.start : node.span.end].split("\n")[0].strip()
        self._findings.add(
            "unexpected-shape", "YAML split this statement at `: `", node.span,
            help=f"quote it: '{written}'",
        )  # fmt: skip

    # --- states ---------------------------------------------------------------------------

    def children(self, node: Node | None) -> tuple[DocState, ...]:
        """Read ``states`` or ``regions``: name: state."""
        mapping = None if node is None else demand_mapping(node, "states", self._findings)
        return () if mapping is None else tuple(self.state(*entry) for entry in mapping.entries)

    refinements = children

    def state(self, name: Text, node: Node) -> DocState:
        """Read one state, or under ``refine`` a change of one."""
        mapping = demand_mapping(node, f"state `{name}`", self._findings)
        if mapping is None:
            return DocState(name, Kind.ATOMIC, name.span)
        check_keys(mapping, frozenset(keys.STATE), f"state `{name}`", self._findings)
        at = {key.value: value for key, value in mapping.entries}
        places = {key.value: key for key, _ in mapping.entries}
        kind = self._kind(at, places)
        is_history = kind in HISTORIES.values()
        data = self._data(at.get("data"))
        done, done_content = self._done(at.get("done"))
        doc = demand_text(at["doc"], "`doc`", self._findings) if "doc" in at else None
        return DocState(
            id=name,
            kind=kind,
            span=name.span,
            initial=self.initial(at.get("default" if is_history else "initial")),
            children=self.children(at.get("regions", at.get("states"))),
            transitions=self._transitions(at),
            entry=self.blocks(at.get("entry")),
            exit=self.blocks(at.get("exit")),
            data=data,
            defer=self.names(at.get("defer"), "an event"),
            invokes=self._invokes(at.get("invoke")),
            done_data=done,
            done_content=done_content,
            invariant=self._optional(at.get("invariant"), "`invariant`"),
            rest=self.flag(at.get("rest"), "rest"),
            abstract=self.flag(at.get("abstract"), "abstract"),
            overrides=frozenset(n.value for n in self.names(at.get("override"), "`override`")),
            doc=doc.value.strip() if doc else "",
        )

    def _kind(self, at: dict[str, Node], places: dict[str, Text]) -> Kind:
        kinds: list[tuple[str, Kind]] = []
        if "regions" in at:
            kinds.append(("regions", Kind.PARALLEL))
        if "states" in at:
            kinds.append(("states", Kind.COMPOUND))
        if "choice" in at:
            kinds.append(("choice", Kind.CHOICE))
        if self.flag(at.get("final"), "final"):
            kinds.append(("final", Kind.FINAL))
        if "history" in at:
            text = demand_text(at["history"], "`history`", self._findings)
            if text is not None and text.value not in HISTORIES:
                self._findings.add(
                    "unexpected-value", f"a history is not `{text.value}`", text,
                    help="use shallow or deep",
                )  # fmt: skip
            kinds.append(("history", HISTORIES.get(text.value if text else "", Kind.DEEP_HISTORY)))
        if len(kinds) > 1:
            first, second = kinds[0][0], kinds[1][0]
            self._findings.add(
                "unexpected-shape", f"a state cannot have both `{first}` and `{second}`",
                places[second], secondary=[(places[first], "the other")],
                help="choose one of them, or nest a state",
            )  # fmt: skip
        return kinds[0][1] if kinds else Kind.ATOMIC

    def _data(self, node: Node | None) -> tuple[DocData, ...]:
        mapping = None if node is None else demand_mapping(node, "`data`", self._findings)
        found = []
        for name, value in mapping.entries if mapping else ():
            text = demand_text(value, "a declaration", self._findings)
            if text is not None:
                found.append(DocData(name, *read_typed(text, self._findings)))
        return tuple(found)

    def _optional(self, node: Node | None, what: str) -> Text | None:
        return None if node is None else demand_text(node, what, self._findings)

    def _arguments(self, node: Node | None) -> tuple[DocArgument, ...]:
        mapping = None if node is None else demand_mapping(node, "`with`", self._findings)
        pairs = mapping.entries if mapping else ()
        texts = ((name, demand_text(value, "a value", self._findings)) for name, value in pairs)
        return tuple(DocArgument(name, text) for name, text in texts if text is not None)

    def _done(self, node: Node | None) -> tuple[tuple[DocArgument, ...], Text | None]:
        mapping = None if node is None else demand_mapping(node, "`done`", self._findings)
        if mapping is None:
            return (), None
        check_keys(mapping, frozenset(keys.DONE), "`done`", self._findings)
        at = {key.value: value for key, value in mapping.entries}
        return self._arguments(at.get("with")), self._optional(at.get("content"), "`content`")

    def _invokes(self, node: Node | None) -> tuple[DocInvoke, ...]:
        if node is None:
            return ()
        items = node.items if isinstance(node, Sequence) else (node,)
        mappings = (demand_mapping(item, "`invoke`", self._findings) for item in items)
        return tuple(self._invoke(mapping) for mapping in mappings if mapping is not None)

    def _invoke(self, mapping: Mapping) -> DocInvoke:
        check_keys(mapping, frozenset(keys.INVOKE), "`invoke`", self._findings)
        at = {key.value: value for key, value in mapping.entries}
        texts = {key: self._optional(at.get(key), f"`{key}`") for key in keys.INVOKE}
        return DocInvoke(
            span=mapping.span,
            id=texts["id"],
            id_location=texts["id_location"],
            type=texts["type"],
            type_expr=texts["type_expr"],
            src=texts["src"],
            src_expr=texts["src_expr"],
            autoforward=self.flag(at.get("autoforward"), "autoforward"),
            arguments=self._arguments(at.get("with")),
            name_list=self.names(at.get("names"), "`names`"),
            content_expr=texts["content_expr"],
            finalize=self.block(at.get("finalize")),
        )

    # --- transitions ----------------------------------------------------------------------

    def initial(self, node: Node | None) -> DocTransition | None:
        """Read ``initial`` or ``default``: targets, or an object with ``target`` and ``do``."""
        if node is None:
            return None
        if isinstance(node, Mapping):
            return self._transition(node, Trigger.INITIAL, ())
        targets = self.names(node, "a state")
        return DocTransition(Trigger.INITIAL, node.span, targets=targets)

    def _transitions(self, at: dict[str, Node]) -> tuple[DocTransition, ...]:
        found: list[DocTransition] = []
        for key, trigger in (
            ("on", Trigger.EVENT),
            ("after", Trigger.AFTER),
            ("every", Trigger.EVERY),
        ):
            mapping = demand_mapping(at[key], f"`{key}`", self._findings) if key in at else None
            for name, node in mapping.entries if mapping else ():
                for item in node.items if isinstance(node, Sequence) else (node,):
                    found.append(self._transition(item, trigger, words(name)))
        for key, trigger in (
            ("always", Trigger.EVENTLESS),
            ("choice", Trigger.EVENTLESS),
            ("sometimes", Trigger.SOMETIMES),
        ):
            if (node := at.get(key)) is not None:
                for item in node.items if isinstance(node, Sequence) else (node,):
                    found.append(self._transition(item, trigger, ()))
        return tuple(found)

    def _transition(self, node: Node, trigger: Trigger, labels: tuple[Text, ...]) -> DocTransition:
        timed = trigger in (Trigger.AFTER, Trigger.EVERY)
        events = () if timed else labels
        delay = labels[0] if timed and labels else None
        span = self._place(node, labels)
        if not isinstance(node, Mapping):
            targets = self.names(node, "a target")
            return DocTransition(trigger, span, events, delay, targets=targets)
        check_keys(node, frozenset(keys.TRANSITION), "a transition", self._findings)
        at = {key.value: value for key, value in node.entries}
        return DocTransition(
            trigger=trigger,
            span=span,
            events=events,
            delay=delay,
            guard=self._optional(at.get("if"), "`if`"),
            targets=self.names(at.get("target"), "a target"),
            internal=self._is_internal(at.get("type")),
            content=self.block(at.get("do")),
            id=self._optional(at.get("id"), "`id`"),
            watchdog=self.flag(at.get("watchdog"), "watchdog"),
            ordered=self.flag(at.get("ordered"), "ordered"),
            first=self.flag(at.get("first"), "first"),
            override=self._optional(at.get("override"), "`override`"),
        )

    def _place(self, node: Node, labels: tuple[Text, ...]) -> Span:
        start, end = node.span.start, node.span.end
        if labels and labels[0].span.start < start:
            start = labels[0].span.start
        source = node.span.source
        line_end = source.text.find("\n", start)
        return Span(source, start, min(end, line_end) if line_end > start else end)

    def _is_internal(self, node: Node | None) -> bool:
        text = self._optional(node, "`type`")
        if text is not None and text.value not in ("internal", "external"):
            self._findings.add(
                "unexpected-value", f"a transition's type is not `{text.value}`", text,
                help="use internal or external",
            )  # fmt: skip
        return text is not None and text.value == "internal"


def words(text: Text) -> tuple[Text, ...]:
    """Split a text at white space and commas, keeping the place of each word."""
    found, start = [], None
    for index, char in enumerate(text.value + " "):
        if char.isspace() or char == ",":
            if start is not None:
                found.append(text.part(start, index))
            start = None
        elif start is None:
            start = index
    return tuple(found)
