"""From nodes of JSON or YAML to a `Machine`: the keys of the library's own configuration.

They are the arguments of `Machine.__init__`, `State.__init__` and `Machine.add_transition`
(transitions 0.9, `core.py` and `extensions/nesting.py`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import PurePath

from fsmkit.diagnostics import Findings, Severity, Source, Span, Text
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.foreign.pytransitions.spec import (
    GENERAL,
    HANDLERS,
    Callbacks,
    Machine,
    Path,
    State,
    Step,
)
from fsmkit.yaml import nodes

POSITIONS = ("trigger", "source", "dest", "conditions", "unless", "before", "after", "prepare")
"""Keys of a transition in list form, in order."""
CHILDREN = ("parallel", "children", "states")
MACHINE_KEYS = frozenset(
    {"name", "states", "initial", "transitions", "queued", "ignore_invalid_triggers", "send_event"}
    | {"auto_transitions", "ordered_transitions", "model_attribute", "model_override", "models"}
    | {"separator", "inputs", *GENERAL}
)
STATE_KEYS = frozenset(
    {"name", "ignore_invalid_triggers", "final", "initial", "transitions", "timeout"}
    | {"tags", "label", *HANDLERS, *CHILDREN}
)
STEP_KEYS = frozenset({*POSITIONS, "label"})
ORDERED = "next_state"
"""The trigger of `ordered_transitions`."""


@dataclass
class Growing:
    """A state while its children are added."""

    path: Path
    span: Span
    fields: dict[str, nodes.Node]
    children: dict[str, Growing] = field(default_factory=dict)

    def names(self, *, deep: bool) -> Iterator[Path]:
        """Yield the paths of the states below, relative to this one."""
        for name, child in self.children.items():
            yield (name,)
            if deep:
                yield from ((name, *below) for below in child.names(deep=True))


def read_machine(root: nodes.Node, source: Source, findings: Findings) -> Machine | None:
    """Return the machine of a configuration, or None after saying why not."""
    mapping = nodes.require_mapping(root, "a machine", findings)
    return None if mapping is None else _Reader(source, findings).machine(mapping)


class _Reader:
    """Reads one configuration."""

    def __init__(self, source: Source, findings: Findings) -> None:
        self._source = source
        self._findings = findings
        self._separator = ""
        """Empty in a machine without nested states."""
        self._steps: list[Step] = []

    def machine(self, mapping: nodes.Mapping) -> Machine | None:
        if any(key.value in ("chart", "system") for key, _ in mapping.entries):
            self._findings.add(
                "not-a-chart",
                "charts are YAML or SCXML; a `.json` configures the library `transitions` and has "
                "the key `states`",
                mapping.entries[0][0],
                help="call the file `.yaml`, of which JSON is a part",
            )
            return None
        fields = self._fields(mapping, MACHINE_KEYS, "a machine")
        if "states" not in fields:
            start = mapping.span.start
            self._findings.add(
                "missing-key",
                "a machine needs states",
                Span(self._source, start, start + 1),
                help="give `states: [...]`; a chart starts with `chart: Name`",
            )
            return None
        states = nodes.require_sequence(fields["states"], "`states`", self._findings)
        if states is None:
            return None
        self._separator = self._separator_of(fields, states)
        root = Growing((), mapping.span, {})
        self._add_states(root, states)
        initial = self._initial(root, fields)
        self._add_steps(root, fields.get("transitions"))
        if "ordered_transitions" in fields and self._flag(fields, "ordered_transitions"):
            self._add_ordered(root, fields["ordered_transitions"], initial)
        return Machine(
            self._source,
            self._name(fields),
            tuple(self._finished(child) for child in root.children.values()),
            initial,
            tuple(self._steps),
            {name: self._callbacks(fields, name) for name in GENERAL},
            frozenset(text.value for text in self._callbacks(fields, "inputs")),
            queued=self._flag(fields, "queued"),
            ignores_invalid=self._flag(fields, "ignore_invalid_triggers"),
            has_automatic=self._flag(fields, "auto_transitions", otherwise=True),
            separator=self._separator or "_",
        )

    def _separator_of(self, fields: dict[str, nodes.Node], states: nodes.Sequence) -> str:
        is_nested = "separator" in fields or any(map(_is_nested, states.items))
        text = self._text(fields, "separator")
        return (text.value if text else "") or ("_" if is_nested else "")

    def _name(self, fields: dict[str, nodes.Node]) -> Text:
        text = self._text(fields, "name")
        if text is not None and text.value:
            return text
        stem = PurePath(self._source.name).name.rpartition(":")[2].partition(".")[0]
        return Text(stem or "machine", Span(self._source, 0, 0))

    # --- states -----------------------------------------------------------------------------

    def _add_states(self, parent: Growing, states: nodes.Sequence) -> None:
        for item in states.items:
            if isinstance(item, nodes.Scalar):
                self._add_named(parent, item.text)
            elif (mapping := nodes.require_mapping(item, "a state", self._findings)) is not None:
                self._add_described(parent, mapping)

    def _add_named(self, parent: Growing, name: Text) -> None:
        """Add a state given by its name, with the ancestors in the name."""
        first, *rest = self._split(name.value)
        if rest:
            if first not in parent.children:
                self._put(parent, first, name.span, {})
            below = self._separator.join(rest)
            self._add_named(parent.children[first], Text(below, name.span))
        else:
            self._put(parent, first, name.span, {})

    def _add_described(self, parent: Growing, mapping: nodes.Mapping) -> None:
        fields = self._fields(mapping, STATE_KEYS, "a state")
        name = self._text(fields, "name")
        if name is None or not name.value:
            self._findings.add(
                "missing-key", "a state needs a name", mapping.span, help="give `name: ...`"
            )
            return
        state = self._put(parent, name.value, name.span, fields)
        for key in CHILDREN:
            if key in fields and (
                children := nodes.require_sequence(fields[key], f"`{key}`", self._findings)
            ):
                self._add_states(state, children)
        self._add_steps(state, fields.get("transitions"))

    def _put(
        self, parent: Growing, name: str, span: Span, fields: dict[str, nodes.Node]
    ) -> Growing:
        if name in parent.children:
            self._findings.add(
                "duplicate-state",
                f"the state `{self._joined((*parent.path, name))}` is given twice",
                span,
                secondary=[(parent.children[name].span, "first here")],
                help="remove one of them",
            )
        state = Growing((*parent.path, name), span, fields)
        return parent.children.setdefault(name, state)

    def _finished(self, state: Growing) -> State:
        fields = state.fields
        initial = tuple(text.value for text in self._callbacks(fields, "initial"))
        if "parallel" in fields:
            initial = tuple(state.children)
        for text in self._callbacks(fields, "initial"):
            if text.value not in state.children:
                self._unknown(text, state)
        return State(
            state.path,
            state.span,
            tuple(self._finished(child) for child in state.children.values()),
            tuple(name for name in initial if name in state.children),
            final=self._flag(fields, "final"),
            timeout=self._text(fields, "timeout"),
            **{key: self._callbacks(fields, key) for key in HANDLERS},
        )

    def _initial(self, root: Growing, fields: dict[str, nodes.Node]) -> tuple[Path, ...]:
        """Return the initial state; by default a new state `initial`."""
        node = fields.get("initial")
        if node is not None and _is_null(node):
            self._findings.add(
                "beyond-statecharts",
                "a machine without an initial state starts in the state of its model",
                node.span,
                help="give `initial`",
            )
            return ()
        if node is None:
            if "initial" not in root.children:
                self._put(root, "initial", Span(self._source, 0, 0), {})
            return (("initial",),)
        found = []
        for text in self._texts(node, "`initial`"):
            path = self._split(text.value)
            if len(path) == 1 and path[0] not in root.children:
                self._put(root, path[0], text.span, {})
            if self._find(root, path) is None:
                self._unknown(text, root)
            else:
                found.append(path)
        return tuple(found)

    # --- transitions ------------------------------------------------------------------------

    def _add_steps(self, scope: Growing, node: nodes.Node | None) -> None:
        if node is None or _is_null(node):
            return
        steps = nodes.require_sequence(node, "`transitions`", self._findings)
        for item in () if steps is None else steps.items:
            fields = self._step_fields(item)
            if fields is not None:
                self._steps += self._expanded(scope, fields, item.span)

    def _step_fields(self, item: nodes.Node) -> dict[str, nodes.Node] | None:
        if isinstance(item, nodes.Sequence):
            fields = dict(zip(POSITIONS, item.items, strict=False))
        else:
            mapping = nodes.require_mapping(item, "a transition", self._findings)
            if mapping is None:
                return None
            fields = self._fields(mapping, STEP_KEYS, "a transition")
        for key in ("trigger", "source", "dest"):
            if key not in fields:
                advice = "`dest: null` is an internal transition" if key == "dest" else "give it"
                message = f"a transition needs `{key}`"
                self._findings.add("missing-key", message, item.span, help=advice)
                return None
        return fields

    def _expanded(
        self, scope: Growing, fields: dict[str, nodes.Node], span: Span
    ) -> Iterator[Step]:
        trigger, dest = self._text(fields, "trigger", is_null=False), self._text(fields, "dest")
        if trigger is None or (dest is None and not _is_null(fields["dest"])):
            return
        for source in self._sources(scope, fields["source"], dest):
            target = None
            if dest is not None:
                target = source if dest.value == "=" else self._absolute(scope, dest)
                if target is None:
                    return
            parts = {key: self._callbacks(fields, key) for key in POSITIONS[3:]}
            yield Step(trigger, source, target, span, scope=scope.path, **parts)

    def _sources(self, scope: Growing, node: nodes.Node, dest: Text | None) -> Iterator[Path]:
        if isinstance(node, nodes.Scalar) and node.text.value == "*":
            deep = dest is not None and dest.value == "="
            yield from ((*scope.path, *below) for below in scope.names(deep=deep))
            return
        for text in self._texts(node, "`source`"):
            path = self._absolute(scope, text)
            if path is not None:
                yield path

    def _absolute(self, scope: Growing, name: Text) -> Path | None:
        path = self._split(name.value)
        if self._find(scope, path) is None:
            self._unknown(name, scope)
            return None
        return (*scope.path, *path)

    def _add_ordered(self, root: Growing, node: nodes.Node, initial: tuple[Path, ...]) -> None:
        """Add the transitions of `add_ordered_transitions`: a cycle through all states."""
        names = list(root.names(deep=True))
        if len(names) < 2:
            self._findings.add(
                "beyond-statecharts",
                "ordered transitions need two states at least",
                node.span,
                help="remove `ordered_transitions`",
            )
            return
        if initial and initial[0] in names:
            first = names.index(initial[0])
            names = names[first:] + names[:first]
        for source, dest in zip(names, [*names[1:], names[0]], strict=True):
            self._steps.append(Step(Text(ORDERED, node.span), source, dest, node.span))

    # --- pieces -----------------------------------------------------------------------------

    def _fields(
        self, mapping: nodes.Mapping, known: frozenset[str], what: str
    ) -> dict[str, nodes.Node]:
        for key, _ in mapping.entries:
            if key.value not in known:
                self._findings.add(
                    "unknown-key",
                    f"the key `{key.value}` of {what} has no meaning in a chart",
                    key,
                    help=suggest(key.value, known, f"known are {', '.join(sorted(known))}"),
                    severity=Severity.WARNING,
                )
        return {key.value: node for key, node in mapping.entries}

    def _text(
        self, fields: dict[str, nodes.Node], key: str, *, is_null: bool = True
    ) -> Text | None:
        """Return a text; ``is_null``: it may be missing, or null."""
        if key not in fields or (is_null and _is_null(fields[key])):
            return None
        return nodes.require_text(fields[key], f"`{key}`", self._findings)

    def _callbacks(self, fields: dict[str, nodes.Node], key: str) -> Callbacks:
        return self._texts(fields[key], f"`{key}`") if key in fields else ()

    def _texts(self, node: nodes.Node, what: str) -> tuple[Text, ...]:
        if _is_null(node):
            return ()
        items = node.items if isinstance(node, nodes.Sequence) else (node,)
        found = (nodes.require_text(item, what, self._findings) for item in items)
        return tuple(text for text in found if text is not None)

    def _flag(self, fields: dict[str, nodes.Node], key: str, *, otherwise: bool = False) -> bool:
        node = fields.get(key)
        if node is None or _is_null(node):
            return otherwise
        text = nodes.require_text(node, f"`{key}`", self._findings)
        if text is None or text.value.lower() in ("true", "false", "model"):
            return text is not None and text.value.lower() != "false"
        self._findings.add(
            "unexpected-value", f"`{key}` is `true` or `false`, not `{text}`", text,
            help="write `true` or `false`",
        )  # fmt: skip
        return False

    def _split(self, name: str) -> Path:
        return tuple(name.split(self._separator)) if self._separator else (name,)

    def _joined(self, path: Path) -> str:
        return (self._separator or "_").join(path)

    def _find(self, scope: Growing, path: Path) -> Growing | None:
        for name in path:
            if name not in scope.children:
                return None
            scope = scope.children[name]
        return scope

    def _unknown(self, name: Text, scope: Growing) -> None:
        known = [self._joined(path) for path in scope.names(deep=True)]
        where = f" within `{self._joined(scope.path)}`" if scope.path else ""
        self._findings.add(
            "unknown-name",
            f"there is no state `{name}`{where}",
            name,
            help=suggest(name.value, known, f"there are: {', '.join(known) or 'none'}"),
        )


def _is_null(node: nodes.Node) -> bool:
    """Whether a node is JSON's or YAML's word for nothing."""
    return (
        isinstance(node, nodes.Scalar) and not node.quoted and node.text.value in ("null", "~", "")
    )


def _is_nested(node: nodes.Node) -> bool:
    keys = {key.value for key, _ in node.entries} if isinstance(node, nodes.Mapping) else set()
    return bool(keys & {*CHILDREN, "transitions"})
