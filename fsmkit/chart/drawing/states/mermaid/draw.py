"""A chart as a state diagram of Mermaid.

Mermaid knows no history, so one is a state ``H`` or ``H*``; and it takes neither ``:`` nor ``;`` in
texts, so they are written as entities.
"""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.chart.chart import Chart, State, Transition
from fsmkit.chart.drawing.states.boxes import is_box, shown
from fsmkit.chart.drawing.states.folding import title_of
from fsmkit.chart.drawing.states.labels import box_lines, is_inside, label
from fsmkit.document.document import Kind, Origin, Trigger
from fsmkit.emit import notating
from fsmkit.emit.mermaid import in_states, title

SYMBOLS = {Kind.SHALLOW_HISTORY: "H", Kind.DEEP_HISTORY: "H*"}
CLASSES = (
    "classDef active fill:#ffd66b,stroke:#b7791f,stroke-width:2px,color:#1f2933",
    "classDef inherited fill:#ffffff,stroke:#9aa5b1,color:#8490a0",
    "classDef history fill:#ffffff,stroke:#1f2933,color:#1f2933",
)


@notating
def draw(chart: Chart, active: frozenset[int]) -> str:
    """Return the text of a diagram; ``active`` states are filled."""
    return "\n".join((*_lines(chart, active), ""))


def _lines(chart: Chart, active: frozenset[int]) -> Iterator[str]:
    yield "---"
    yield f"title: {title(chart.name)}"
    yield "---"
    yield "stateDiagram-v2"
    yield "  direction TB"
    yield from _children(chart, chart.root, "  ")
    for transition in chart.transitions:
        if transition.trigger is not Trigger.INITIAL or chart.states[transition.source].is_history:
            yield from (f"  {line}" for line in _arrows(chart, transition))
    yield from (f"  {line}" for line in CLASSES)
    for name, states in _classes(chart, active):
        if states:
            yield f"  class {','.join(_name(state) for state in states)} {name}"


def _classes(chart: Chart, active: frozenset[int]) -> Iterator[tuple[str, list[State]]]:
    drawn = shown(chart)
    plain = [s for s in chart.states[1:] if s.kind is not Kind.CHOICE and s.index in drawn]
    yield "active", [s for s in plain if s.index in active]
    rest = [s for s in plain if s.index not in active]
    yield "inherited", [s for s in rest if s.origin is Origin.INHERITED]
    yield "history", [s for s in rest if s.is_history and s.origin is not Origin.INHERITED]


def _children(chart: Chart, state: State, margin: str) -> Iterator[str]:
    if state.initial is not None and state.kind is not Kind.PARALLEL:
        transition = chart.transitions[state.initial]
        yield from (margin + line for line in _arrows_from(chart, "[*]", transition))
    regions = [s for s in (chart.states[child] for child in state.children) if not s.is_history]
    for child in (chart.states[child] for child in state.children):
        if state.kind is Kind.PARALLEL and child in regions[1:]:
            yield f"{margin}--"
        yield from _state(chart, child, margin)


def _state(chart: Chart, state: State, margin: str) -> Iterator[str]:
    name, texts = _name(state), box_lines(chart, state)
    match state.kind:
        case Kind.CHOICE:
            yield f"{margin}state {name} <<choice>>"
            return
        case Kind.COMPOUND | Kind.PARALLEL if not is_box(state):
            yield f'{margin}state "{in_states(title_of(chart, state))}" as {name} {{'
            yield from _children(chart, state, margin + "  ")
            yield f"{margin}}}"
            if texts:
                yield f"{margin}note right of {name}"
                yield from (f"{margin}  {in_states(line)}" for line in texts)
                yield f"{margin}end note"
        case _:
            title_ = SYMBOLS.get(state.kind) or title_of(chart, state)
            yield f'{margin}state "{in_states(title_)}" as {name}'
            if texts:
                yield f"{margin}{name} : {'<br/>'.join(in_states(line) for line in texts)}"
            if state.kind is Kind.FINAL:
                yield f"{margin}{name} --> [*]"


def _arrows(chart: Chart, transition: Transition) -> Iterator[str]:
    if is_inside(transition):
        return
    yield from _arrows_from(chart, _name(chart.states[transition.source]), transition)


def _arrows_from(chart: Chart, source: str, transition: Transition) -> Iterator[str]:
    """Yield the arrow of a transition; one with several targets goes through the bar of a fork."""
    words = _label(chart, transition)
    targets = [_name(chart.states[target]) for target in transition.targets]
    if len(targets) == 1:
        yield f"{source} --> {targets[0]}{words}"
        return
    fork = f"fork_{transition.index}"
    yield f"state {fork} <<fork>>"
    yield f"{source} --> {fork}{words}"
    for target in targets:
        yield f"{fork} --> {target}"


def _label(chart: Chart, transition: Transition) -> str:
    lines = label(chart, transition).lines
    return f" : {'<br/>'.join(in_states(line) for line in lines)}" if lines else ""


def _name(state: State) -> str:
    return f"s{state.index}"
