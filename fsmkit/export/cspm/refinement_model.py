"""Write a derived chart and its base in CSPm: ``assert BASE [T= DERIVED``."""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.chart.chart import Chart
from fsmkit.emit import notating
from fsmkit.export.cspm.comparison import Comparison, Sight, Steps
from fsmkit.export.cspm.identifiers import TAKEN, Script, comment, offer
from fsmkit.export.identifiers import Names, word
from fsmkit.export.local_states import in_order, names_and_texts
from fsmkit.language.values import show
from fsmkit.runtime.interpreter.snapshot import Occurrence, Snapshot
from fsmkit.verify.properties.refinement_view import Group, Shown
from fsmkit.verify.report.counterexample import leaves, occurrence_text

HEADER = """\
Whether {derived} refines {base}, for FDR and other tools of CSP; written by fsmkit. It belongs to
whoever had it written.

An event is the base's view of a step: the event of the base that is handled, the operations
called and the events sent, as far as the base declares them, and its outputs afterwards.
`{process}` takes the steps of the derived chart, untimed, up to the first that `{spec}` cannot
follow; `{spec}` has the steps of the base, each after its unobservable ones. The assertion is
that of `fsmkit refine`.\
"""
LONGEST = 60
"""Letters of a name built from the base's view of a step."""


@notating
def write_refinement(found: Comparison) -> str:
    """Return both processes, and the assertion."""
    names, out = Names(TAKEN), Script()
    spec, process, variable = names.take(found.base.name.upper()), "", names.take("e")
    process = names.take(found.derived.name.upper())
    out.remark(
        HEADER.format(
            derived=comment(found.derived.name),
            base=comment(found.base.name),
            process=process,
            spec=spec,
        ),
    )
    for sample in found.samples:
        out.remark(f"Only some values are tried of {comment(sample)}.")
    out.line()
    sights = dict.fromkeys(sight for to in found.derived_steps.values() for sight, _ in to)
    named = {}
    for sight in sights:
        text = ", ".join(_seen(found.base, sight)) or "nothing"
        named[sight] = names.take(word(text)[:LONGEST])
        out.line(f"channel {named[sight]}  -- {comment(text)}")
    graphs = (spec, found.base, found.base_steps), (process, found.derived, found.derived_steps)
    for name, chart, steps in graphs:
        out.line()
        out.title(chart.name)
        _process(out, names, name, variable, chart, steps, named)
    out.line()
    out.line(f"assert {spec} [T= {process}")
    return out.finish()


def _process(
    out: Script,
    names: Names,
    name: str,
    variable: str,
    chart: Chart,
    steps: Steps,
    named: dict[Sight, str],
) -> None:
    """Write an equation for each state of a chart."""
    snapshots = in_order(chart, [state for state in steps if state is not None])
    texts = names_and_texts(chart, snapshots)
    local: dict[Snapshot | None, str] = {None: name}
    for snapshot, (short, _) in zip(snapshots, texts, strict=True):
        local[snapshot] = names.take(f"{name}_{short}")
    explained = ["not started", *(text for _, text in texts)]
    states: list[Snapshot | None] = [None, *snapshots]
    for state, text in zip(states, explained, strict=True):
        out.remark(comment(text))
        by_target: dict[str, list[str]] = {}
        for sight, to in steps[state]:
            by_target.setdefault(local[to], []).append(named[sight])
        terms = [offer(variable, events, to) for to, events in by_target.items()]
        out.equation(local[state], terms)


def _seen(base: Chart, sight: Sight) -> Iterator[str]:
    """Yield the base's view of a step in words."""
    tick = base.capacities.tick
    for group in sight.word:
        yield from _of_group(base, group)
    for output, value in zip(base.outputs, sight.outputs, strict=False):
        yield f"{output.name} = {show(value, output.type, tick)}"
    types = {declared.name: declared.type for declared in base.inputs}
    for name, value in sight.inputs:
        shown = show(value, types[name], tick) if name in types else value
        yield f"while {name} = {shown}"
    if sight.place is not None:
        yield f"goes on in {'+'.join(leaves(base, sight.place))}"


def _of_group(base: Chart, group: Group) -> Iterator[str]:
    if group.stimulus is not None:
        yield occurrence_text(base, group.stimulus.event)
    if group.free:
        yield "free"
    for shown in group.shown:
        yield _shown(base, shown)


def _shown(base: Chart, shown: Shown) -> str:
    if not shown.is_operation:
        return occurrence_text(base, Occurrence(base.event_index[shown.name], shown.values))
    (operation,) = [o for o in base.operations if o.name == shown.name]
    tick = base.capacities.tick
    pairs = zip(operation.parameters, shown.values, strict=True)
    given = ", ".join(show(value, parameter.type, tick) for parameter, value in pairs)
    if shown.result is None or operation.result is None:
        return f"{shown.name}({given})"
    return f"{shown.name}({given}) returns {show(shown.result, operation.result, tick)}"
