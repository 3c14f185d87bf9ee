"""A chart as a tree on the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict

from rich.text import Text
from rich.tree import Tree

from fsmkit.chart.chart import Chart, Data, Event, State, Transition
from fsmkit.chart.format import (
    format_block,
    format_function,
    format_operation,
    format_signature,
    format_trigger,
)
from fsmkit.chart.views.origins import ItemOrigin, Origins
from fsmkit.chart.views.properties import environment_parts, format_property
from fsmkit.diagnostics import Span
from fsmkit.document import keys
from fsmkit.document.document import Kind, Origin, Trigger
from fsmkit.language import EnumType, RecordType, Type, format_expression, format_value

STYLES = {Origin.OWN: "", Origin.INHERITED: "dim", Origin.OVERRIDDEN: "yellow"}


def chart_tree(chart: Chart, origins: Origins, *, with_origin: bool) -> Tree:
    """Return the tree of a chart: its declarations, then its states."""
    return _Maker(chart, origins, with_origin).tree()


def directions(event: Event) -> str:
    """Return the directions of an event, or `platform` if the platform raises it."""
    return " and ".join(sorted(d.value for d in event.directions)) or "platform"


def type_text(type_: Type) -> str:
    """Return a declared type with its members or fields."""
    match type_:
        case EnumType(name, members, numbers):
            pairs = zip(members, numbers, strict=True)
            listed = members if type_.is_counted else [f"{m} = {n}" for m, n in pairs]
            return f"{name}: {', '.join(listed)}"
        case RecordType(name, fields):
            return f"{name}: {', '.join(f'{f.name} {f.type}' for f in fields)}"
        case _:
            return str(type_)


class _Maker:
    def __init__(self, chart: Chart, origins: Origins, with_origin: bool) -> None:
        self.chart = chart
        self.origins = origins
        self.with_origin = with_origin
        self.copies: dict[int, str] = {}  # by state, the innermost that it is in
        for copy in chart.copies:  # those within another follow it
            last = chart.states[copy.state].last_descendant
            self.copies |= dict.fromkeys(range(copy.state + 1, last + 1), copy.name)

    def tree(self) -> Tree:
        chart = self.chart
        heading = Text(chart.name, "bold")
        marks = [
            *(["abstract"] if chart.abstract else []),
            *([f"extends {chart.base}"] if chart.base is not None else []),
            *keys.marks(chart, (keys.REQ,)),
        ]
        heading.append(f"  {', '.join(marks)}" if marks else "", "italic")
        tree = Tree(heading)
        if chart.doc:
            tree.add(Text(chart.doc, "italic"))
        self._declarations(tree)
        if chart.script:
            tree.add(Text(f"script: {format_block(chart.script, chart)}"))
        self.states(tree.add(Text("states", "bold")))
        return tree

    def states(self, tree: Tree) -> None:
        """Add the states of the chart."""
        self._initial(tree, self.chart.root)
        for child in self.chart.root.children:
            self._state(tree, self.chart.states[child])

    def _line(self, label: str, where: ItemOrigin, marks: Iterable[str] = ()) -> Text:
        line = Text(label, STYLES[where.origin])
        listed = ", ".join(marks)
        line.append(f"  {listed}" if listed else "", "italic")
        if self.with_origin:
            line.append(f"  [{where}]", "cyan" if where.origin is Origin.OWN else "magenta")
        return line

    # --- declarations ---------------------------------------------------------------------

    def _declarations(self, tree: Tree) -> None:
        chart, tick = self.chart, self.chart.capacities.tick
        nowhere = ItemOrigin(Origin.OWN, None)
        self._group(
            tree,
            "types",
            [(type_text(t), self.origins.types.get(str(t), nowhere)) for t in chart.types],
        )
        self._group(
            tree,
            "constants",
            [
                (f"{name} = {format_value(value.value, value.type, tick)}",
                 self.origins.constants.get(name) or self._named(name, Origin.OWN, value.span))
                for name, value in chart.constants
            ],
        )  # fmt: skip
        for name, data in (
            ("data", chart.data), ("inputs", chart.inputs), ("outputs", chart.outputs),
        ):  # fmt: skip
            is_input = name == "inputs"
            self._group(
                tree,
                name,
                [(self._data(d, is_input), self._named(d.name, d.origin, d.span)) for d in data],
            )
        self._group(
            tree,
            "operations",
            [
                (format_operation(o, chart), self._named(o.name, o.origin, o.span))
                for o in chart.operations
            ],
            [keys.marks(o, (keys.REQ,)) for o in chart.operations],
        )
        self._group(
            tree,
            "functions",
            [
                (format_function(f, chart), self.origins.functions.get(f.name, nowhere))
                for f in chart.functions
            ],
        )
        self._group(tree, "events", [self._event(e) for e in chart.events])
        self._capacities(tree)
        self._group(
            tree,
            "properties",
            [(format_property(p), ItemOrigin(p.origin, p.name.span)) for p in chart.properties],
            [keys.marks(p, (keys.REQ,)) for p in chart.properties],
        )
        if chart.environment is not None:
            group = tree.add(Text("environment", "bold"))
            for key, items in environment_parts(chart.environment).items():
                group.add(Text(f"{key} {', '.join(items)}"))

    def _group(
        self,
        tree: Tree,
        name: str,
        items: list[tuple[str, ItemOrigin]],
        marks: Sequence[list[str]] = (),
    ) -> None:
        if items:
            group = tree.add(Text(name, "bold"))
            for (label, where), marked in zip(items, marks or [[]] * len(items), strict=True):
                group.add(self._line(label, where, marked))

    def _data(self, data: Data, is_input: bool) -> str:
        if is_input:
            return f"{data.name}: {data.type}"
        start = format_value(data.init.value, data.type, self.chart.capacities.tick)
        return f"{data.name}: {data.type} = {start}"

    def _event(self, event: Event) -> tuple[str, ItemOrigin]:
        signature = format_signature(event.name, event.fields, event.reply)
        if not event.fields and event.reply is None:
            signature = event.name
        return f"{directions(event):8} {signature}", self._named(
            event.name, event.origin, event.span
        )

    def _capacities(self, tree: Tree) -> None:
        values = asdict(self.chart.capacities)
        values["tick"] = f"{values['tick']}us"
        group = tree.add(Text("capacities", "bold"))
        for name, value in values.items():
            if name in self.origins.capacities:
                group.add(self._line(f"{name} {value}", self.origins.capacities[name]))
            else:
                group.add(Text(f"{name} {value}  (default)", "dim"))

    def _named(self, name: str, origin: Origin, span: Span | None) -> ItemOrigin:
        """Return the origin of a name; a dotted name is declared in a copy."""
        names = [c.name for c in self.chart.copies if name.startswith(f"{c.name}.")]
        return ItemOrigin(origin, span, max(names, key=len, default=""))

    def _within(self, state: int, origin: Origin, span: Span) -> ItemOrigin:
        """Return the origin of a state or of a part of it."""
        copy = self.copies.get(state, "")
        is_here = any(span.source.name == source.name for source in self.chart.sources)
        return ItemOrigin(origin, span, "" if is_here else copy)

    def _title(self, state: State) -> str:
        used = [copy.chart for copy in self.chart.copies if copy.state == state.index]
        return f"{state.id}: {used[0]}" if used else state.id

    # --- states ---------------------------------------------------------------------------

    def _state(self, tree: Tree, state: State) -> None:
        chart = self.chart
        marks = [
            *([state.kind.value] if state.kind is not Kind.ATOMIC else []),
            *keys.marks(state, keys.kept_keys(keys.STATE, State)),
        ]
        node = tree.add(
            self._line(
                self._title(state), self._within(state.index, state.origin, state.span), marks
            )
        )
        tick = chart.capacities.tick
        if state.doc:
            node.add(Text(state.doc, "italic"))
        if state.invariant is not None:
            node.add(
                self._part(
                    "invariant",
                    format_expression(state.invariant, tick),
                    state.invariant.span,
                    state.index,
                )
            )
        if state.defer:
            names = ", ".join(chart.events[e].name for e in state.defer)
            node.add(Text(f"defer {names}"))
        for word, blocks in (("entry", state.on_entry), ("exit", state.on_exit)):
            for block in blocks:
                if block:
                    node.add(
                        self._part(word, format_block(block, chart), block[0].span, state.index)
                    )
        self._invoked(node, state)
        self._initial(node, state)
        for index in state.transitions:
            node.add(self._transition(chart.transitions[index]))
        for child in state.children:
            self._state(node, chart.states[child])

    def _invoked(self, tree: Tree, state: State) -> None:
        """Add the invocations of a state, each chart with its states."""
        for block in state.invokes:
            label = format_block(block, self.chart).removeprefix("invoke ")
            tree.add(self._part("invoke", label, block[0].span, state.index))
        for invocation in self.chart.invocations:
            if invocation.state != state.index:
                continue
            marks = ["autoforward"] if invocation.autoforward else []
            where = ItemOrigin(state.origin, invocation.span)
            inner = f"{invocation.id}: {invocation.chart.name}"
            node = tree.add(self._line(inner, where, marks))
            own = [e for e in self.chart.events if e.invocation == invocation.index and e.finalize]
            for label in dict.fromkeys(format_block(event.finalize, self.chart) for event in own):
                node.add(Text(f"finalize: {label}"))
            within = _Maker(invocation.chart, self.origins, self.with_origin)
            within.states(node)

    def _part(self, word: str, label: str, span: Span, state: int) -> Text:
        """Return a line whose origin is the file that contains it."""
        bases = {source.name for source in self.chart.sources[1:]}
        origin = Origin.INHERITED if span.source.name in bases else Origin.OWN
        return self._line(f"{word}: {label}", self._within(state, origin, span))

    def _initial(self, tree: Tree, state: State) -> None:
        if state.initial is not None:
            tree.add(self._transition(self.chart.transitions[state.initial]))

    def _transition(self, transition: Transition) -> Text:
        chart = self.chart
        label = format_trigger(transition, chart)
        if transition.guard is not None:
            label += f" if {format_expression(transition.guard, chart.capacities.tick)}"
        if transition.targets:
            label += f" -> {', '.join(chart.states[t].id for t in transition.targets)}"
        if transition.content:
            label += f" / {format_block(transition.content, chart)}"
        marks = keys.marks(transition, keys.kept_keys(keys.TRANSITION, Transition))
        # an implied initial transition has the location of its state
        implied = transition.trigger is Trigger.INITIAL and (
            transition.span == chart.states[transition.source].span
        )
        if implied:
            marks.append("implied")
        where = self._within(transition.source, transition.origin, transition.span)
        return self._line(label, where, marks)
