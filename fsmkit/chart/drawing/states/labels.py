"""Labels of arrows and states: UML's `event [guard] / actions`, wrapped."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass

from fsmkit.chart.chart import Chart, State, Transition
from fsmkit.chart.drawing.states.boxes import is_box
from fsmkit.chart.format import format_block, format_statement, format_trigger
from fsmkit.chart.statements import Block, If, Statement
from fsmkit.document.document import Kind, Trigger
from fsmkit.emit import telling
from fsmkit.language import Binary, BinaryOp, Expr, format_expression

WIDTH = 26
"""Characters of a line beside an arrow; more makes the drawing wide, fewer makes it tall."""
STATE_WIDTH = 34
"""Characters of a line in a state."""
MARGIN = "  "
"""Before lines that go on."""
MOST_LINES = 12
"""Longer content is cut: a drawing is for the overview."""


@dataclass(frozen=True, slots=True)
class Label:
    """The parts of a transition's label, each as wrapped lines."""

    trigger: tuple[str, ...]
    guard: tuple[str, ...]
    actions: tuple[str, ...]

    @property
    def lines(self) -> tuple[str, ...]:
        """All lines; short parts share one."""
        parts = [" ".join(part) for part in (self.trigger, self.guard, self.actions) if part]
        if len(" ".join(parts)) <= WIDTH:
            return (" ".join(parts),) if parts else ()
        return (*self.trigger, *self.guard, *self.actions)


@telling
def label(chart: Chart, transition: Transition, width: int = WIDTH) -> Label:
    """Return the label of a transition; a default one has only actions."""
    return Label(
        _trigger_lines(trigger(chart, transition), width),
        guard(chart, transition, width),
        actions("/ ", transition.content, chart, width),
    )


@telling
def trigger(chart: Chart, transition: Transition) -> str:
    """Return the trigger of a transition; empty for eventless and default ones."""
    if transition.trigger in (Trigger.EVENTLESS, Trigger.INITIAL):
        return ""
    text = format_trigger(transition, chart).removeprefix("on ")
    name, written = transition.delay_name, transition.delay_text
    if transition.least is not None or transition.trigger is Trigger.EVENT:
        return text
    word, _, delay = text.partition(" ")
    if name is not None:
        return f"{word} {name} ({delay})"
    return text if written is None else f"{word} {written}"


@telling
def guard(chart: Chart, transition: Transition, width: int = WIDTH) -> tuple[str, ...]:
    """Return the guard in brackets; `else` on the last branch of a choice."""
    if transition.guard is None:
        source = chart.states[transition.source]
        is_else = source.kind is Kind.CHOICE and len(source.transitions) > 1
        return ("[else]",) if is_else else ()
    tick = chart.capacities.tick
    pieces = [format_expression(part, tick) for part in _conjuncts(transition.guard)]
    if len(pieces) == 1:
        return wrapped(f"[{pieces[0]}]", width, " ")
    return wrapped(f"[{' and '.join(_bracketed(p) for p in pieces)}]", width, " ")


def _conjuncts(expr: Expr) -> tuple[Expr, ...]:
    if isinstance(expr, Binary) and expr.op is BinaryOp.AND:
        return (*_conjuncts(expr.left), *_conjuncts(expr.right))
    return (expr,)


def _bracketed(piece: str) -> str:
    return f"({piece})" if " or " in piece or " ? " in piece else piece


@telling
def actions(head: str, block: Block, chart: Chart, width: int) -> tuple[str, ...]:
    """Return statements after ``head``, as many on a line as fit, branches on their own lines."""
    lines: list[str] = []
    line = head
    for number, statement in enumerate(block, 1):
        end = "" if number == len(block) else ";"
        text = format_statement(statement, chart) + end
        is_fresh = line in (head, MARGIN)
        if not is_fresh and len(line) + 1 + len(text) > width:
            lines += wrapped(line, width, MARGIN)
            line, is_fresh = MARGIN, True
        if isinstance(statement, If) and len(line) + len(text) > width:
            *some, line = _branches(line, statement, chart, width)
            lines += some
            line += end
        else:
            line += text if is_fresh else f" {text}"
    return cut((*lines, *wrapped(line, width, MARGIN))) if block else ()


def _branches(
    head: str, statement: If[Expr, Statement], chart: Chart, width: int
) -> tuple[str, ...]:
    lines: list[str] = []
    for branch in statement.branches:
        opening = head if not lines else f"{MARGIN}}} else "
        if branch.condition is not None:
            opening += f"if {format_expression(branch.condition, chart.capacities.tick)} "
        lines += wrapped(opening + "{", width, MARGIN * 2)
        inner = actions(MARGIN, branch.body, chart, width - len(MARGIN))
        lines += (MARGIN + line for line in inner)
    return (*lines, MARGIN + "}")


def wrapped(text: str, width: int, margin: str) -> tuple[str, ...]:
    """Return a text in lines, those after the first with a margin."""
    if _is_line(text, width):
        return (text,)
    return tuple(
        textwrap.wrap(
            text,
            width,
            subsequent_indent=margin,
            break_long_words=False,
            break_on_hyphens=False,
            drop_whitespace=True,
        )
    )


def _trigger_lines(text: str, width: int) -> tuple[str, ...]:
    """Return a trigger in lines."""
    if _is_line(text, width):
        return (text,)
    return tuple(textwrap.wrap(text, width, break_long_words=False))


def _is_line(text: str, width: int) -> bool:
    """Whether wrapping leaves a text as it is, which is most often so."""
    return 0 < len(text) <= width and text.isprintable() and text == text.strip()


def cut(lines: tuple[str, ...]) -> tuple[str, ...]:
    """Return at most `MOST_LINES` lines; the last one marks that there are more."""
    return lines if len(lines) <= MOST_LINES else (*lines[: MOST_LINES - 1], "  ...")


def is_inside(transition: Transition) -> bool:
    """Whether a transition is shown in the box of its state: it has no target."""
    return not transition.targets


@telling
def box_lines(chart: Chart, state: State) -> tuple[str, ...]:
    """Return the lines in a state below its name.

    They show entry, exit, invocations, deferred events and the state's own reactions.
    """
    reactions = (line for _, lines in own_reactions(chart, state) for line in lines)
    return (*content_lines(chart, state), *reactions)


@telling
def content_lines(chart: Chart, state: State) -> tuple[str, ...]:
    """Return the lines in a state before its own reactions."""
    lines: list[str] = []
    if is_box(state) and state.last_descendant > state.index:
        inside = chart.states[state.index + 1 : state.last_descendant + 1]
        count = sum(not each.is_history for each in inside)
        lines.append(_inside(count))
    for copy in chart.copies:
        if copy.state == state.index and copy.count:
            lines.append(_inside(copy.count))
        if copy.state == state.index and copy.path:
            lines += wrapped(f"in {copy.path}", STATE_WIDTH, MARGIN)
    for word, blocks in (("entry", state.on_entry), ("exit", state.on_exit)):
        for block in blocks:
            lines += actions(f"{word} / ", block, chart, STATE_WIDTH)
    for invocation in chart.invocations:
        if invocation.state == state.index:
            text = f"invoke {invocation.id}: {invocation.chart.name}"
            lines += wrapped(text, STATE_WIDTH, MARGIN)
    if state.defer:
        events = ", ".join(chart.events[event].name for event in state.defer)
        lines += wrapped(f"defer {events}", STATE_WIDTH, MARGIN)
    if state.invariant is not None:
        text = format_expression(state.invariant, chart.capacities.tick)
        lines += wrapped(f"invariant {text}", STATE_WIDTH, MARGIN)
    return tuple(lines)


def _inside(count: int) -> str:
    return f"{count} state{'s' if count > 1 else ''} inside"


@telling
def own_reactions(chart: Chart, state: State) -> tuple[tuple[int, tuple[str, ...]], ...]:
    """Return the transitions that are text in their state, by number, each with its lines."""
    return tuple(
        (index, _reaction(chart, chart.transitions[index]))
        for index in state.transitions
        if is_inside(chart.transitions[index])
    )


def _reaction(chart: Chart, transition: Transition) -> tuple[str, ...]:
    parts = (trigger(chart, transition), " ".join(guard(chart, transition, 10**6)))
    head = " ".join(part for part in parts if part)
    if not transition.content:
        return wrapped(f"{head} /", STATE_WIDTH, MARGIN)
    content = format_block(transition.content, chart)
    if len(head) + 3 + len(content) <= STATE_WIDTH:
        return (f"{head} / {content}",)
    return cut(
        (
            *wrapped(head, STATE_WIDTH, MARGIN),
            *(MARGIN + line for line in actions("/ ", transition.content, chart, STATE_WIDTH - 2)),
        )
    )
