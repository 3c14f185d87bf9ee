"""Change the used chart of an inherited state: more bindings, other values, a derived chart."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from fsmkit.diagnostics import Findings, Text
from fsmkit.document.document import DocExit, DocState, DocUse
from fsmkit.language.statements.tree import DocArgument


def refine_use(base: DocState, entry: DocState, what: str, findings: Findings) -> DocUse | None:
    """Return the use of a chart in a refined state, or None if it has none.

    Values of constants and start values replace inherited ones. Unbound names and exit points may
    be bound. With `override`, the exits may change. So may the chart, if the new one extends the
    inherited one: then all bindings remain valid.
    """
    old, new = base.use, entry.use
    if new is None:
        return old
    if old is None:
        if base.children:
            findings.add(
                "forbidden-change",
                f"{what} holds states in the base and cannot be filled by a chart",
                new.span,
                secondary=[(base.span, "the inherited state")],
                help="add a state that is filled under `states`",
            )
            return None
        return new
    return replace(
        old,
        chart=_chart(old, new, entry, what, findings),
        loaded=new.loaded or old.loaded,
        reset=old.reset or new.reset,
        constants=_values(old.constants, new.constants),
        start=_values(old.start, new.start),
        bind=_bound(old, new, what, findings),
        exits=_exits(old, new, entry, what, findings),
        span=new.span if new.chart is not None else old.span,
    )


def _chart(old: DocUse, new: DocUse, entry: DocState, what: str, findings: Findings) -> Text | None:
    if new.chart is None:
        return old.chart
    if "use" not in entry.overrides:
        findings.add(
            "unmarked-override",
            f"the chart that fills {what} replaces the base's",
            new.chart,
            secondary=[] if old.chart is None else [(old.chart, "what it replaces")],
            help="mark it with `override: [use]`, or remove it",
        )
    known = {document.source.name for document in new.loaded}
    if old.loaded and new.loaded and old.loaded[0].source.name not in known:
        findings.add(
            "forbidden-change",
            f"`{new.chart}` does not extend `{old.chart}`, which fills {what} in the base",
            new.chart,
            help=f"use a chart that extends `{old.chart}`: all bindings mean something there",
        )
    return new.chart


def _values(old: tuple[DocArgument, ...], new: tuple[DocArgument, ...]) -> tuple[DocArgument, ...]:
    given = {one.name.value: one for one in new}
    names = {one.name.value for one in old}
    kept = (given.get(one.name.value, one) for one in old)
    return (*kept, *(one for one in new if one.name.value not in names))


def _bound(old: DocUse, new: DocUse, what: str, findings: Findings) -> tuple[DocArgument, ...]:
    taken = {one.name.value: one.name for one in old.bind}
    _report_rebinding(
        ((one.name, taken.get(one.name.value)) for one in new.bind),
        f"is bound in the base of {what} and cannot be bound again",
        "leave it as it is; a derived chart binds what the base leaves open",
        findings,
    )
    return (*old.bind, *(one for one in new.bind if one.name.value not in taken))


def _exits(
    old: DocUse, new: DocUse, entry: DocState, what: str, findings: Findings
) -> tuple[DocExit, ...]:
    taken = {one.name.value: one.name for one in old.exits}
    if "exits" not in entry.overrides:
        _report_rebinding(
            ((one.name, taken.get(one.name.value)) for one in new.exits),
            f"is bound in the base of {what}",
            "mark the change with `override: [exits]`",
            findings,
        )
    given = {one.name.value: one for one in new.exits}
    kept = (given.get(one.name.value, one) for one in old.exits)
    return (*kept, *(one for one in new.exits if one.name.value not in taken))


def _report_rebinding(
    pairs: Iterable[tuple[Text, Text | None]], why: str, advice: str, findings: Findings
) -> None:
    for name, before in pairs:
        if before is not None:
            findings.add(
                "redefines-inherited",
                f"`{name}` {why}",
                name,
                secondary=[(before, "bound here")],
                help=advice,
            )
