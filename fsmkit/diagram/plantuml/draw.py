"""A chart as a state diagram of PlantUML."""

from __future__ import annotations

import re
from collections.abc import Iterator

from fsmkit.diagram.labels import box_lines, is_inside, label
from fsmkit.model.chart import Chart, State, Transition
from fsmkit.model.document import Kind, Origin, Trigger

CREOLE = re.compile(r'["\\<>{}~%|`]|([*/_#=.!\-\[\]])\1+|^[*#=]')
"""What PlantUML's markup, macros or quotes would take for their own."""
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


def draw(chart: Chart, active: frozenset[int]) -> str:
    """Return the text of a diagram; ``active`` states are filled."""
    return "\n".join((*_lines(chart, active), ""))


def _lines(chart: Chart, active: frozenset[int]) -> Iterator[str]:
    yield "@startuml"
    yield f"title {_text(chart.name)}"
    yield from STYLE
    yield from _children(chart, chart.root, active, "")
    for transition in chart.transitions:
        if transition.trigger is not Trigger.INITIAL or chart.states[transition.source].is_history:
            yield from _arrows(chart, transition)
    yield "@enduml"


def _children(chart: Chart, state: State, active: frozenset[int], margin: str) -> Iterator[str]:
    regions = [s for s in (chart.states[child] for child in state.children) if not s.is_history]
    for child in (chart.states[child] for child in state.children):
        if state.kind is Kind.PARALLEL and child in regions[1:]:
            yield f"{margin}--"
        yield from _state(chart, child, active, margin)
    if state.initial is not None and state.kind is not Kind.PARALLEL:
        transition = chart.transitions[state.initial]
        for target in transition.targets:
            arrow = f"[*] -{_look(transition)}-> {_name(chart.states[target])}"
            yield margin + arrow + _label(chart, transition)


def _state(chart: Chart, state: State, active: frozenset[int], margin: str) -> Iterator[str]:
    name, texts = _name(state), box_lines(chart, state)
    kind = STEREOTYPES.get(state.kind, "")
    if state.kind is Kind.FINAL and texts:
        kind = ""
    color = ""
    if state.index in active:
        color = " #ffd66b;line:b7791f;line.bold"
    elif state.origin is Origin.INHERITED:
        color = " #white;line:9aa5b1;text:8490a0"
    opening = f'{margin}state "{_text(state.id)}" as {name}{kind}{color}'
    if state.kind in (Kind.COMPOUND, Kind.PARALLEL):
        yield f"{opening} {{"
        yield from _children(chart, state, active, margin + "  ")
        yield f"{margin}}}"
    else:
        yield opening
    if not kind:
        yield from (f"{margin}{name} : {_text(line)}" for line in texts)


def _arrows(chart: Chart, transition: Transition) -> Iterator[str]:
    if is_inside(transition):
        return
    source, words = _name(chart.states[transition.source]), _label(chart, transition)
    targets = [_name(chart.states[target]) for target in transition.targets]
    arrow = f"-{_look(transition)}->"
    if len(targets) == 1:
        yield f"{source} {arrow} {targets[0]}{words}"
        return
    fork = f"fork_{transition.index}"
    yield f"state {fork} <<fork>>"
    yield f"{source} {arrow} {fork}{words}"
    for target in targets:
        yield f"{fork} {arrow} {target}"


def _look(transition: Transition) -> str:
    """Return the style of an arrow: inherited ones are grey, watchdogs dashed."""
    styles = ["#9aa5b1"] if transition.origin is Origin.INHERITED else []
    styles += ["dashed"] if transition.watchdog else []
    return f"[{','.join(styles)}]" if styles else ""


def _label(chart: Chart, transition: Transition) -> str:
    lines = label(chart, transition).lines
    return " : " + NEW_LINE.join(_text(line) for line in lines) if lines else ""


def _name(state: State) -> str:
    return f"s{state.index}"


def _text(text: str) -> str:
    """Return a text with what PlantUML takes for its own written as code points."""
    clean = "".join(char if char.isprintable() else " " for char in text)
    spaces = len(clean) - len(clean.lstrip(" "))
    escaped = CREOLE.sub(lambda m: "".join(f"<U+{ord(char):04X}>" for char in m[0]), clean[spaces:])
    return "<U+00A0>" * spaces + escaped
