"""A chart in the language of Graphviz: states in clusters, one arrow for each transition.

Graphviz draws arrows between nodes only. An arrow from or to a compound state is drawn from or to a
node in it and clipped at the border of its cluster (``ltail``, ``lhead``).

In SVG a state is the element ``s12``, a transition ``t25``: an arrow, or a link in the box of its
state (``a_t25``, as Graphviz names it). Further pieces of it are ``t25_1`` and so on, its text is
``w25`` if it is a separate element. Classes are ``state`` or ``transition``, where it comes from
(``own``, ``inherited``, ``overridden``) and ``watchdog``. The tooltip is the place in the source.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import PurePath

from fsmkit.chart.chart import Chart, State, Transition
from fsmkit.chart.drawing.states.boxes import shown
from fsmkit.chart.drawing.states.folding import point_of, title_of
from fsmkit.chart.drawing.states.labels import (
    box_lines,
    content_lines,
    is_inside,
    label,
    own_reactions,
)
from fsmkit.diagnostics import Span
from fsmkit.document.document import Kind, Origin, Trigger
from fsmkit.emit import notating
from fsmkit.emit.dot import escaped, font, label_with_title, left, quoted, statement

FONT = "Helvetica,Arial,sans-serif"
TITLE, NAME, SMALL = 16, 12, 10
"""Sizes of type, in points."""
INK, SOFT, GREY = "#1f2933", "#52606d", "#8490a0"
"""Colours of the chart's own elements, of content, and of inherited elements."""
WATCHDOG = "#b45309"
ACTIVE, ACTIVE_BORDER, ACTIVE_AREA = "#ffd66b", "#b7791f", "#fff8e1"
AREAS = ("#f5f7fa", "#ffffff")
"""Fill colours of compound states, alternating with their depth."""
ROUNDED, DASHED = "rounded,filled", "rounded,filled,dashed"
"""Styles of the boxes of states; regions are dashed."""
BELOW_BORDER = 3
"""Points between the border of a cluster and its title, besides those of Graphviz."""
INVISIBLE = {"shape": "point", "style": "invis", "width": "0.01"}
SYMBOLS = {Kind.SHALLOW_HISTORY: "H", Kind.DEEP_HISTORY: "H*"}


@notating
def draw(chart: Chart, active: frozenset[int]) -> str:
    """Return the text of a diagram; ``active`` states are filled."""
    return "\n".join((*Drawer(chart, active).lines(), ""))


@dataclass(frozen=True, slots=True)
class End:
    """One end of an arrow: a node, and the cluster at whose border the arrow is clipped."""

    node: str
    clip: str = ""


@dataclass(frozen=True)
class Drawer:
    """Draws one chart."""

    chart: Chart
    active: frozenset[int]

    def lines(self) -> Iterator[str]:
        """Return the lines of the graph."""
        title = font(f"<b>{escaped(self.chart.name)}</b>", INK, TITLE)
        yield f"digraph {quoted(self.chart.name)} {{"
        yield "  " + statement(
            "graph", compound="true", rankdir="TB", nodesep=0.3, ranksep=0.4, fontname=FONT,
            label=f"<{title}>", labelloc="t", pad=0.2, bgcolor="white",
        )  # fmt: skip
        yield "  " + statement(
            "node", fontname=FONT, fontsize=NAME, color=INK, shape="box", style=ROUNDED,
            fillcolor="white", margin="0.12,0.06", height=0.36,
        )  # fmt: skip
        yield "  " + statement("edge", fontname=FONT, fontsize=SMALL, color=INK, arrowsize=0.7)
        yield from self._children(self.chart.root, "  ")
        for transition in self._drawn:
            if not self._is_state_text(transition):
                yield from self._arrows(transition)
        yield "}"

    @cached_property
    def _drawn(self) -> tuple[Transition, ...]:
        """The transitions that a state lists; the others are not drawn."""
        listed = {index for state in self.chart.states for index in state.transitions}
        listed |= {state.initial for state in self.chart.states if state.initial is not None}
        return tuple(t for t in self.chart.transitions if t.index in listed)

    # --- states ---------------------------------------------------------------------------

    def _children(self, state: State, margin: str) -> Iterator[str]:
        color = _ink(state.origin)
        if state.initial is not None:
            yield margin + statement(
                _initial(state), shape="circle", fillcolor=color, color=color, label="",
                width=0.13, height=0.13, fixedsize="true",
            )  # fmt: skip
            initial = self.chart.transitions[state.initial]
            if len(initial.targets) > 1:
                yield margin + self._fork_bar(initial)
        else:
            yield margin + statement(_initial(state), **INVISIBLE)
        if any(self._goes_inside(self.chart.transitions[t]) for t in state.transitions):
            yield margin + statement(
                _own(state), shape="circle", color=color, label="", width=0.11, height=0.11,
                fixedsize="true", tooltip=state.id,
            )  # fmt: skip
        for index in state.children:
            child = self.chart.states[index]
            if self._is_cluster(index):
                yield f"{margin}subgraph {quoted(_cluster(child))} {{"
                yield f"{margin}  {self._area(child)}"
                yield from self._children(child, margin + "  ")
                yield f"{margin}}}"
            else:
                yield margin + self._node(child)
            yield from (margin + line for line in self._beside(child))
        yield from self._order(state, margin)

    def _order(self, state: State, margin: str) -> Iterator[str]:
        """Keep the initial dot of a state above its children, and below them where arrows leave."""
        inner = [self.chart.states[child] for child in state.children]
        tops = [_initial(s) if self._is_cluster(s.index) else _node_name(s) for s in inner]
        yield f"{margin}{_initial(state)} -> {{{' '.join(tops)}}} [style=invis, weight=0];"

    def _area(self, state: State) -> str:
        """Return the attributes of a cluster; regions are dashed."""
        is_active = state.index in self.active
        return statement(
            "graph",
            label=self._box(state, "left"),
            labeljust="l",
            labelloc="t",
            style=DASHED if self._is_region(state) else ROUNDED,
            color=ACTIVE_BORDER if is_active else _ink(state.origin),
            fillcolor=ACTIVE_AREA if is_active else AREAS[state.depth % 2],
            penwidth=1.8 if is_active else 1,
            margin=12,
            **_known_as(state),
        )

    def _is_region(self, state: State) -> bool:
        """Whether a state is a region, whose box is dashed."""
        return self.chart.states[state.parent or 0].kind is Kind.PARALLEL

    def _node(self, state: State) -> str:
        is_active = state.index in self.active
        color = ACTIVE_BORDER if is_active else _ink(state.origin)
        fill = ACTIVE if is_active else "white"
        name = _node_name(state)
        match state.kind:
            case Kind.SHALLOW_HISTORY | Kind.DEEP_HISTORY:
                return statement(
                    name, shape="circle", label=SYMBOLS[state.kind], fontsize=SMALL, width=0.3,
                    fixedsize="true", color=color, fontcolor=color, **_known_as(state),
                )  # fmt: skip
            case Kind.CHOICE:
                return statement(
                    name, shape="diamond", style="filled", label="", width=0.3, height=0.3,
                    color=color, fillcolor=fill, xlabel=self._small(state), **_known_as(state),
                )  # fmt: skip
            case Kind.FINAL if not box_lines(self.chart, state):
                return statement(
                    name, shape="doublecircle", style="filled", label="", width=0.13, height=0.13,
                    fixedsize="true", color=color, fillcolor=fill if is_active else color,
                    xlabel=self._small(state), **_known_as(state),
                )  # fmt: skip
            case _:
                return statement(
                    name, label=self._box(state), color=color, fillcolor=fill,
                    penwidth=1.8 if is_active else 1,
                    peripheries=2 if state.kind is Kind.FINAL else 1,
                    **({"style": DASHED} if self._is_region(state) else {}), **_known_as(state),
                )  # fmt: skip

    def _small(self, state: State) -> str:
        return f"<{font(escaped(title_of(self.chart, state)), _soft(state.origin), SMALL)}>"

    def _box(self, state: State, align: str = "center") -> str:
        """Return name and content of a state; an abstract one is in italics.

        A folded copy has its entry points above and its exit points below.
        """
        name = f"<b>{escaped(title_of(self.chart, state))}</b>"
        title = font(f"<i>{name}</i>" if state.abstract else name, _ink(state.origin), NAME)
        rows: list[tuple[tuple[str, ...], dict[str, str]]] = []
        if content := content_lines(self.chart, state):
            rows.append((content, {}))
        for index, lines in own_reactions(self.chart, state):
            rows.append((lines, _link(self.chart.transitions[index])))
        for index in state.transitions:
            transition = self.chart.transitions[index]
            if self._is_state_text(transition) and not is_inside(transition):
                again = " ".join(label(self.chart, transition).lines)
                rows.append(((f"{again} \N{CLOCKWISE OPEN CIRCLE ARROW}",), _link(transition)))
        color = _soft(state.origin)
        cells = [(font(left(lines), color, SMALL), more) for lines, more in rows]
        points = [self._point(self.chart.states[p]) for p in self._points_of(state)]
        above = [cell for kind, cell in points if kind == "entry"]
        below = [cell for kind, cell in points if kind == "exit"]
        room = BELOW_BORDER if self._is_cluster(state.index) else 0
        return label_with_title(title, cells, align, above=above, below=below, room=room)

    def _point(self, point: State) -> tuple[str, tuple[str, dict[str, str]]]:
        """Return the kind of a point of a folded copy, and its cell, where arrows end."""
        kind = point_of(self.chart, point)
        sign = "\N{CIRCLED TIMES}" if kind == "exit" else "\N{WHITE CIRCLE}"
        text = f"{sign} {escaped(title_of(self.chart, point))}"
        own = f"s{point.index}"
        more = {
            "port": _port(point), "border": "1", "style": "rounded", "cellpadding": "2",
            "color": _soft(point.origin), "id": own, "href": f"#{own}", "title": _place(point.span),
        }  # fmt: skip
        if point.index in self.active:
            more["bgcolor"] = ACTIVE
        return kind, (font(text, _soft(point.origin), SMALL), more)

    def _points_of(self, state: State) -> tuple[int, ...]:
        """Return the entry and exit points of a folded copy; nothing for any other state."""
        is_folded = any(copy.is_folded and copy.state == state.index for copy in self.chart.copies)
        return state.children if is_folded else ()

    @cached_property
    def _boxes(self) -> dict[int, int]:
        """The folded copy in whose box each entry and exit point stands."""
        return {p: state.index for state in self.chart.states for p in self._points_of(state)}

    def _end(self, state: State) -> str:
        """Return the end of arrows at a state that is not a cluster: its node, or a port in one."""
        box = self._boxes.get(state.index)
        own = _node_name(state)
        return own if box is None else f"{_node_name(self.chart.states[box])}:{_port(state)}"

    def _beside(self, state: State) -> Iterator[str]:
        """Draw the nodes beside a state for its arrows: bars of forks, texts of long arrows.

        The text of an arrow from a compound state is a node of its own: as a label Graphviz would
        put it halfway from the node inside, perhaps into the part that is clipped.
        """
        default = (state.initial,) if state.is_history and state.initial is not None else ()
        for transition in (self.chart.transitions[t] for t in (*state.transitions, *default)):
            text = self._label(transition)
            if len(transition.targets) > 1:
                yield self._fork_bar(transition)
            elif text and self._is_cluster(state.index) and self._leaves(transition):
                more = {**text, **_piece_of(transition, "text")}
                yield statement(_words(transition), shape="plain", fillcolor="none", **more)

    def _fork_bar(self, transition: Transition) -> str:
        """Return the bar of a transition with several targets, a fork in UML."""
        color = self._look(transition)["color"]
        return statement(
            _bar(transition), shape="box", style="filled", label="", width=0.5, height=0.05,
            fixedsize="true", fillcolor=color, color=color, **_piece_of(transition, "bar"),
        )  # fmt: skip

    # --- transitions ----------------------------------------------------------------------

    def _is_state_text(self, transition: Transition) -> bool:
        """Whether a transition is text in its state: it has no target or is a cluster's loop."""
        return is_inside(transition) or (
            transition.trigger is not Trigger.INITIAL
            and transition.targets == (transition.source,)
            and self._is_cluster(transition.source)
        )

    def _goes_inside(self, transition: Transition) -> bool:
        """Whether a compound state's transition leads to a state inside it."""
        return (
            transition.trigger is not Trigger.INITIAL
            and self._is_cluster(transition.source)
            and any(self.chart.is_descendant(t, transition.source) for t in transition.targets)
        )

    def _leaves(self, transition: Transition) -> bool:
        """Whether a compound state's transition is drawn from its border."""
        return not (self._is_state_text(transition) or self._goes_inside(transition))

    def _is_cluster(self, state: int) -> bool:
        """Whether states are drawn in a state: not in one that is folded."""
        children = self.chart.states[state].children
        return bool(children) and children[0] not in self._boxes

    @cached_property
    def _shown(self) -> frozenset[int]:
        return shown(self.chart)

    def _arrows(self, transition: Transition) -> Iterator[str]:
        """Draw a transition.

        Arrows to states that were written earlier are turned round for Graphviz (``dir=back``): so
        no arrow can push a state above those before it, and the drawing follows the document.
        """
        source = self.chart.states[transition.source]
        look, text = self._look(transition), self._label(transition)
        if len(transition.targets) > 1:
            yield from self._fork(transition, source)
            return
        target = self.chart.states[transition.targets[0]]
        is_down = transition.trigger is Trigger.INITIAL or source.index <= target.index
        tail = self._tail(transition, source, is_down)
        head = self._head(source, target, is_down)
        if not text or not tail.clip:
            yield _edge(tail, head, is_down, {**text, **look, **_piece_of(transition)})
            return
        words = End(_words(transition))
        first = _piece_of(transition, "1")
        yield _edge(tail, words, is_down, {**look, "dir": "none", **first})
        yield _edge(words, head, is_down, {**look, **_piece_of(transition)})

    def _fork(self, transition: Transition, source: State) -> Iterator[str]:
        """Draw a transition into several regions: one arrow to a bar, and one from it to each."""
        look, bar = self._look(transition), End(_bar(transition))
        tail = self._tail(transition, source, is_down=True)
        more = {**self._label(transition), **look, **_piece_of(transition)}
        yield _edge(tail, bar, True, {**more, "dir": "none"})
        for place, target in enumerate(transition.targets, 1):
            own = {**look, **_piece_of(transition, str(place))}
            yield _edge(bar, self._head(source, self.chart.states[target], True), True, own)

    def _tail(self, transition: Transition, source: State, is_down: bool) -> End:
        """Return the start of the arrow of a transition."""
        if transition.trigger is Trigger.INITIAL and not source.is_history:
            return End(_initial(source))
        if not self._is_cluster(source.index):
            return End(self._end(source))
        if self._goes_inside(transition):
            return End(_own(source))
        return End(self._lowest(source) if is_down else _initial(source), _cluster(source))

    def _head(self, source: State, target: State, is_down: bool) -> End:
        """Return the end of an arrow."""
        if not self._is_cluster(target.index):
            return End(self._end(target))
        if source is target or self.chart.is_descendant(source.index, target.index):
            return End(_initial(target))
        return End(_initial(target) if is_down else self._lowest(target), _cluster(target))

    def _lowest(self, state: State) -> str:
        """Return the lowest node of a cluster, by the estimate of `_ranks`."""
        inside = range(state.index + 1, state.last_descendant + 1)
        leaves = [
            i
            for i in inside
            if i in self._shown
            and i not in self._boxes
            and not self._is_cluster(i)
            and not self.chart.states[i].is_history
        ]
        if not leaves:
            return _initial(state)
        return _node_name(self.chart.states[max(leaves, key=lambda i: (self._ranks[i], i))])

    @cached_property
    def _ranks(self) -> list[int]:
        """Estimate the rank of each state in Graphviz: the length of the longest path to it."""
        states = self.chart.states
        ranks = [0] * len(states)
        incoming: list[list[int]] = [[] for _ in states]
        for transition in self._drawn:
            source = self._boxes.get(transition.source, transition.source)
            for target in (self._boxes.get(end, end) for end in transition.targets):
                if source < target:
                    incoming[target].append(source)
        for state in states[1:]:
            above = [ranks[state.parent or 0]]
            for source in incoming[state.index]:
                last = states[source].last_descendant
                is_around = state.index <= last
                above.append(ranks[source] if is_around else max(ranks[source : last + 1]))
            ranks[state.index] = max(above) + 1
        return ranks

    def _look(self, transition: Transition) -> dict[str, str]:
        color = _ink(transition.origin)
        if not transition.watchdog:
            return {"color": color}
        is_inherited = transition.origin is Origin.INHERITED
        return {"color": color if is_inherited else WATCHDOG, "style": "dashed"}

    def _label(self, transition: Transition) -> dict[str, str]:
        """Return the label of an arrow, its guard and actions softer than its trigger."""
        parts = label(self.chart, transition)
        if not parts.lines:
            return {}
        ink, soft = _ink(transition.origin), _soft(transition.origin)
        if len(parts.lines) == 1:
            words = [(parts.trigger, ink), (parts.guard, soft), (parts.actions, soft)]
            printed = [font(escaped(" ".join(t)), color, SMALL) for t, color in words if t]
            return {"label": f"< {' '.join(printed)} >"}
        rest = (*parts.guard, *parts.actions)
        above = font(left(parts.trigger), ink, SMALL) if parts.trigger else ""
        below = font(left(rest), soft, SMALL) if rest else ""
        return {
            "label": '<<table border="0" cellborder="0" cellspacing="0" cellpadding="2">'
            f'<tr><td align="left" balign="left">{above}{below}</td></tr></table>>'
        }


def _edge(tail: End, head: End, is_down: bool, look: dict[str, str]) -> str:
    """Return an arrow; one that leads up is turned round."""
    first, second = (tail, head) if is_down else (head, tail)
    clips = {"ltail": first.clip, "lhead": second.clip}
    look = {**{key: clip for key, clip in clips.items() if clip}, **look}
    if not is_down:
        look = {"dir": "back", **look}
    return "  " + statement(f"{first.node} -> {second.node}", **look)


def _known_as(state: State) -> dict[str, str]:
    """Return the attributes of a state in SVG: id, class and tooltip."""
    return {
        "id": f"s{state.index}",
        "class": f"state {state.origin.value}",
        "tooltip": state.id + ", " + _place(state.span),
    }


def _piece_of(transition: Transition, piece: str = "") -> dict[str, str]:
    """Return the attributes of a piece of a transition in SVG: id, class and tooltip."""
    own, is_text = f"t{transition.index}", piece == "text"
    return {
        "id": f"w{transition.index}" if is_text else own + (f"_{piece}" if piece else ""),
        "class": f"{_class_of(transition)} {own}",
        "tooltip": _place(transition.span),
    }


def _link(transition: Transition) -> dict[str, str]:
    """Return the link of a transition that is text in its state: only links have an id."""
    own = f"t{transition.index}"
    return {"id": own, "href": f"#{own}", "title": _place(transition.span)}


def _class_of(transition: Transition) -> str:
    watchdog = " watchdog" if transition.watchdog else ""
    return f"transition {transition.origin.value}{watchdog}"


def _place(span: Span) -> str:
    """Return a source location: the name of the file, and the line."""
    line, _ = span.source.position(span.start)
    return f"{_file_name(span.source.name)}:{line}"


@lru_cache(maxsize=64)
def _file_name(path: str) -> str:
    return PurePath(path).name


def _ink(origin: Origin) -> str:
    return GREY if origin is Origin.INHERITED else INK


def _soft(origin: Origin) -> str:
    return GREY if origin is Origin.INHERITED else SOFT


def _node_name(state: State) -> str:
    return f"s{state.index}"


def _cluster(state: State) -> str:
    return f"cluster_{state.index}"


def _initial(state: State) -> str:
    return f"initial_{state.index}"


def _words(transition: Transition) -> str:
    return f"label_{transition.index}"


def _bar(transition: Transition) -> str:
    return f"fork_{transition.index}"


def _port(state: State) -> str:
    return f"p{state.index}"


def _own(state: State) -> str:
    return f"own_{state.index}"
