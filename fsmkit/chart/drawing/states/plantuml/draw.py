"""A chart as a state diagram of PlantUML."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from fsmkit.chart.chart import Chart, State, Transition
from fsmkit.chart.drawing.states.boxes import is_box
from fsmkit.chart.drawing.states.folding import point_of, title_of
from fsmkit.chart.drawing.states.labels import box_lines, is_inside, label
from fsmkit.document.document import Kind, Origin, Trigger
from fsmkit.emit import notating
from fsmkit.emit.plantuml import escaped

NEW_LINE = r"\n"
STEREOTYPES = {
    Kind.SHALLOW_HISTORY: " <<history>>",
    Kind.DEEP_HISTORY: " <<history*>>",
    Kind.CHOICE: " <<choice>>",
    Kind.FINAL: " <<end>>",
}
STYLE = (
    "hide empty description",
    "skinparam shadowing false",
    "skinparam state {",
    "  BackgroundColor white",
    "  BorderColor #1f2933",
    "  FontColor #1f2933",
    "}",
)


@notating
def draw(chart: Chart, active: frozenset[int]) -> str:
    """Return the text of a diagram; ``active`` states are filled."""
    return "\n".join((*_lines(chart, active), ""))


def _lines(chart: Chart, active: frozenset[int]) -> Iterator[str]:
    yield "@startuml"
    yield f"title {escaped(chart.name)}"
    yield from STYLE
    yield from _children(chart, chart.root, active, "")
    for transition in chart.transitions:
        if _is_of_a_region(chart, transition):
            continue
        if transition.trigger is not Trigger.INITIAL or chart.states[transition.source].is_history:
            yield from _arrows(chart, transition)
    yield "@enduml"


def _children(chart: Chart, state: State, active: frozenset[int], margin: str) -> Iterator[str]:
    regions = [s for s in (chart.states[child] for child in state.children) if not s.is_history]
    for child in (chart.states[child] for child in state.children):
        if state.kind is Kind.PARALLEL and child in regions[1:]:
            yield f"{margin}--"
        yield from _state(chart, child, active, margin)
        for transition in (chart.transitions[number] for number in child.transitions):
            if _is_of_a_region(chart, transition):
                yield from (margin + line for line in _arrows(chart, transition))
    if state.initial is not None and state.kind is not Kind.PARALLEL:
        transition = chart.transitions[state.initial]
        around = _regions_around(chart, state.index)
        ends = {t: _end(chart, t, around) for t in transition.targets}
        yield from (margin + line for line in _arrows_from(chart, "[*]", transition, ends))


def _state(chart: Chart, state: State, active: frozenset[int], margin: str) -> Iterator[str]:
    name, texts = _name(state), box_lines(chart, state)
    kind = STEREOTYPES.get(state.kind, "")
    if point := point_of(chart, state):
        kind = f" <<{point}Point>>"
    if state.kind is Kind.FINAL and texts:
        kind = ""
    color = ""
    if state.index in active:
        color = " #ffd66b;line:b7791f;line.bold"
    elif state.origin is Origin.INHERITED:
        color = " #white;line:9aa5b1;text:8490a0"
    opening = f'{margin}state "{escaped(title_of(chart, state))}" as {name}{kind}{color}'
    if state.kind in (Kind.COMPOUND, Kind.PARALLEL) and not is_box(state):
        yield f"{opening} {{"
        yield from _children(chart, state, active, margin + "  ")
        yield f"{margin}}}"
    else:
        yield opening
    if not kind:
        yield from (f"{margin}{name} : {escaped(line)}" for line in texts)


def _arrows(chart: Chart, transition: Transition) -> Iterator[str]:
    if is_inside(transition):
        return
    around = _regions_around(chart, transition.source)
    ends = {t: _end(chart, t, around) for t in transition.targets}
    common = set.intersection(*(set(_regions_around(chart, t)) for t in transition.targets))
    source = _end(chart, transition.source, tuple(common))
    from_ = _words(chart, "from", transition.source, source)
    yield from _arrows_from(chart, f"s{source}", transition, ends, from_)


def _arrows_from(
    chart: Chart,
    source: str,
    transition: Transition,
    ends: Mapping[int, int],
    more: tuple[str, ...] = (),
) -> Iterator[str]:
    """Yield the arrow of a transition; one with several targets goes through the bar of a fork.

    ``ends``: for each target, the state at whose border its arrow ends. ``more``: further lines of
    the label.
    """
    arrow = f"-{_look(transition)}->"
    if len(ends) == 1:
        ((target, end),) = ends.items()
        words = _label(chart, transition, more + _words(chart, "to", target, end))
        yield f"{source} {arrow} s{end}{words}"
        return
    fork = f"fork_{transition.index}"
    yield f"state {fork} <<fork>>"
    yield f"{source} {arrow} {fork}{_label(chart, transition, more)}"
    for target, end in ends.items():
        yield f"{fork} {arrow} s{end}{_after_colon(_words(chart, 'to', target, end))}"


def _is_of_a_region(chart: Chart, transition: Transition) -> bool:
    """Whether an arrow leads from a region to itself.

    PlantUML rejects it for a first region without states, unless it is drawn in the region.
    """
    parent = chart.states[transition.source].parent
    return (
        transition.targets == (transition.source,)
        and parent is not None
        and chart.states[parent].kind is Kind.PARALLEL
    )


def _regions_around(chart: Chart, state: int) -> tuple[int, ...]:
    """Return the regions that a state lies in, the innermost first; a region is in itself."""
    found = []
    at: int | None = state
    while at is not None:
        parent = chart.states[at].parent
        if parent is not None and chart.states[parent].kind is Kind.PARALLEL:
            found.append(at)
        at = parent
    return tuple(found)


def _end(chart: Chart, state: int, others: Sequence[int]) -> int:
    """Return the end of an arrow that starts in other regions.

    PlantUML draws no arrow across the border of a region: such a one ends at the parallel state.
    """
    crossed = [region for region in _regions_around(chart, state) if region not in others]
    if not crossed:
        return state
    parent = chart.states[crossed[-1]].parent
    assert parent is not None  # noqa: S101  (a region has one)
    return parent


def _words(chart: Chart, word: str, state: int, end: int) -> tuple[str, ...]:
    """Return a label that names a state inside ``end`` whose arrow is drawn at its border."""
    return () if state == end else (f"{word} {chart.states[state].id}",)


def _look(transition: Transition) -> str:
    """Return the style of an arrow: inherited ones are grey, watchdogs dashed."""
    styles = ["#9aa5b1"] if transition.origin is Origin.INHERITED else []
    styles += ["dashed"] if transition.watchdog else []
    return f"[{','.join(styles)}]" if styles else ""


def _label(chart: Chart, transition: Transition, more: tuple[str, ...] = ()) -> str:
    return _after_colon((*label(chart, transition).lines, *more))


def _after_colon(lines: tuple[str, ...]) -> str:
    return " : " + NEW_LINE.join(escaped(line) for line in lines) if lines else ""


def _name(state: State) -> str:
    return f"s{state.index}"
