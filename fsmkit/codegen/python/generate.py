"""A chart as a Python module. This file is the table of contents of the generated text."""

from __future__ import annotations

import re
from collections.abc import Iterator

from fsmkit.chart.chart import Chart
from fsmkit.codegen.python import invoking, movement, plain, relations, saving, sending, template
from fsmkit.codegen.python.content import ContentPrinter, Needs
from fsmkit.codegen.python.expressions import spell
from fsmkit.codegen.python.family import Member, family_of, is_alone
from fsmkit.codegen.python.features import features_of
from fsmkit.codegen.python.head import print_head, wrapped
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.python.names import Names, members_of
from fsmkit.codegen.python.selection import (
    Offers,
    bit,
    has_regions,
    is_needing_memo,
    print_selection,
)
from fsmkit.codegen.python.straight import Straight
from fsmkit.codegen.python.trees import Trees
from fsmkit.codegen.python.trimming import trimmed, without_suites, without_trace
from fsmkit.document.document import Trigger
from fsmkit.plan import Plan, lower
from fsmkit.plan.image import Image
from fsmkit.texts import printing
from fsmkit.texts.python import docstring, paragraph

HEADER = '''\
"""{doc}

Made by fsmkit from {source}: change that, not this. Times are ticks of {tick} us, modulo 2^32.
"""

from __future__ import annotations

{imports}from collections.abc import {abstract}
from enum import IntEnum
{tools}from typing import Any, ClassVar, Protocol

CLOCK = 0xFFFFFFFF
FAR = 0x80000000
NOTHING = -1
'''


@printing
def module_text(
    chart: Chart, *, traced: bool = False, prefix: str | None = None, saved: bool = False
) -> str:
    """Return the text of the module: the same for the same chart. ``prefix`` names the class.

    ``saved``: the machine can be saved and restored. Without a trace there is no `trace` to set,
    and nothing is spent on it; machines that invoke others always have it.
    """
    family = family_of(chart, prefix)
    members = tuple(family.everyone)
    kind = template.machine if is_alone(chart) else template.invoking
    shared = kind(saved=saved)
    needs = tuple(Needs() for _ in members)
    pairs = zip(members, needs, strict=True)
    classes = [_class(*pair, shared, traced=traced, saved=saved) for pair in pairs]
    parts = [shared.bases, *classes]
    arithmetic = template.arithmetic("\n".join(parts))
    pieces = (
        _header(chart, "\n".join((arithmetic, *parts))),
        *enumerations(family.names),
        _values(family.names),
        *(_bits(member.chart, member.names) for member in members),
        arithmetic,
        host(family.names, list(zip(members, needs, strict=True))),
        *parts,
    )
    return "\n\n\n".join(piece.strip("\n") for piece in pieces if piece) + "\n"


def _class(
    member: Member, needs: Needs, shared: template.Template, *, traced: bool, saved: bool
) -> str:
    """Return a class: alone with all that it needs, else derived from what several share."""
    chart, names = member.chart, member.names
    plan = lower(chart)
    image = Image(plan) if saved else None
    content = ContentPrinter(chart, names, needs)
    is_traced = traced or bool(shared.bases)
    body = Lines(1, is_traced=is_traced)
    _moves(body, plan, names, content, is_seen=is_traced)
    _guards(body, chart, names)
    if shared.bases:
        invoking.print_invocations(body, member, content)
    own = body.finish()
    answered = None if traced or shared.bases else plain.answered(chart, names, own)
    if answered is not None:
        plain.print_dispatch(body)
    features = features_of(chart, needs, own, trace=traced)
    if not shared.bases:
        features.print_stand_ins(body)
    sending.print_senders(body, chart, names, needs, answered)
    _conditions(body, needs)
    _tables(body, names, shared)
    head = Lines(1)
    if image is not None:
        saving.print_histories(body, image, names)
    print_head(head, plan, member, needs, shared, image)
    if shared.bases:
        return f"class {names.machine}({template.BASES[1]}):\n{head.finish()}{body.finish()}"
    own = body.finish()
    text = f"{head.finish()}\n{template.without(shared.body, own)}\n"
    unneeded = [features.unneeded, *([] if image is None else [saving.unneeded(image)])]
    text = text if traced else without_trace(text)
    for openings in unneeded:
        text = without_suites(text, openings)
    text += own
    table = "" if answered is None else f"\n\n\n{plain.print_table(chart, names, answered)}"
    return f"class {names.machine}:\n{trimmed(text)}{table}"


def _header(chart: Chart, text: str) -> str:
    known = [name for name in ("math", "struct", "zlib") if f"{name}." in text]
    used = [name for name in known if re.search(rf"\b{name}\.\w+\(", text)]
    iterates = "islice(" in text
    source = re.split(r"[/\\]", chart.sources[0].name)[-1] if chart.sources else "a chart"
    doc = chart.doc or "The machine " + chart.name + "."
    return HEADER.format(
        doc=paragraph(doc),
        source=docstring(source),
        tick=chart.capacities.tick,
        imports="".join(f"import {name}\n" for name in used),
        abstract="Callable, Iterator" if iterates else "Callable",
        tools="from itertools import islice\n" if iterates else "",
    )


def enumerations(names: Names) -> Iterator[str]:
    """Print the enumerations that are declared, by any machine of the module."""
    for type_, name in names.enumerations.items():
        out = Lines()
        with out.suite(f"class {name}(IntEnum):"):
            out.line('"""An enumeration of the chart."""')
            out.line()
            for place, member in enumerate(members_of(type_)):
                out.line(f"{member} = {place}")
        yield out.finish()


def _values(names: Names) -> str:
    """Return the members of enumerations as plain integers, which a step computes with."""
    lines = [
        f"{constant} = {names.enumerations[type_]}.{members_of(type_)[number]}.value"
        for (type_, number), constant in names.members.items()
        if isinstance(number, int)
    ]
    return "\n".join(lines)


def _bits(chart: Chart, names: Names) -> str:
    """Return the constants of a chart, of its states, a bit each, and of its timers."""
    literals = (literal for _, literal in chart.constants)
    lines = [
        f"{name} = {spell(literal.value, literal.type)}"
        for literal, name in zip(literals, names.constants.values(), strict=True)
    ]
    pairs = zip(chart.states, names.states, strict=True)
    lines += [f"{name} = {bit(state.index)}" for state, name in pairs]
    if not has_regions(chart):
        lines += relations.configurations(chart, names)
    return "\n".join([*lines, *(f"{name} = {index}" for index, name in names.timers.items())])


def host(names: Names, members: list[tuple[Member, Needs]]) -> str:
    """Return what the host is asked for, by all machines of the module."""
    methods = {
        method[0]: method
        for member, needs in members
        for method in sending.host_methods(member.chart, member.names, needs)
    }
    if not methods:
        return ""
    out = Lines()
    with out.suite(f"class {names.machine}Host(Protocol):"):
        out.line('"""What the machine asks of its host: methods of a subclass, or of an object."""')
        for name, passed, result, doc in methods.values():
            with out.method(name, doc, ", ".join(passed), result):
                out.line("...")
    return out.finish()


def _moves(out: Lines, plan: Plan, names: Names, content: ContentPrinter, *, is_seen: bool) -> None:
    """Print what events, eventless transitions and timeouts do."""
    chart, offers = plan.chart, Offers(plan.chart)
    if not print_selection(out, chart, names, offers, "_select_eventless", None):
        with out.method("_select_eventless", "There are no eventless transitions.", result="int"):
            out.line("return 0")
    mover = movement.Mover(out, plan, names, content)
    trees = Trees(out, chart, names, mover, is_seen)
    straight = Straight(out, plan, names, content, mover, trees, offers, is_seen)
    straight.events()
    mover.states()
    mover.transitions(straight.apart)
    trees.print()


def _guards(out: Lines, chart: Chart, names: Names) -> None:
    from fsmkit.codegen.python.expressions import Printer
    from fsmkit.codegen.python.selection import payload_of

    for transition in chart.transitions:
        if transition.guard is None or not _has_guard_method(chart, transition.index):
            continue
        name = f"_guard_{names.transitions[transition.index]}"
        with out.method(name, f"The guard of {place_of(chart, transition.index)}.", result="bool"):
            printer = Printer(names, payload_of(chart, transition))
            out.line(f"held: bool = {printer.print(transition.guard)}")
            out.line("return held")


def _has_guard_method(chart: Chart, index: int) -> bool:
    transition = chart.transitions[index]
    is_timed = transition.trigger in (Trigger.AFTER, Trigger.EVERY)
    return transition.guard is not None and (is_timed or is_needing_memo(chart, transition))


def place_of(chart: Chart, index: int) -> str:
    """Return what a transition is, and where it was written."""
    return relations.describe(chart, chart.transitions[index])


def _conditions(out: Lines, needs: Needs) -> None:
    for number, text in enumerate(needs.conditions):
        with out.method(
            f"_holds_{number}", "A condition; false if it cannot be evaluated.", result="bool"
        ):
            with out.suite("try:"):
                out.line(f"held: bool = {text}")
                out.line("return held")
            with out.suite("except ContentError:"):
                out.line("self._error_execution()")
                out.line("return False")


def _tables(out: Lines, names: Names, shared: template.Template) -> None:
    text = out.finish()
    defined = set(re.findall(r"^    def (\w+)\(", text, re.MULTILINE))

    def table(name: str, methods: list[str]) -> None:
        entries = [m if m in defined else "None" for m in methods]
        wrapped(out, f"{name}: {shared.constants[name]} = (", entries, ")")

    out.line()
    states, transitions = names.bare, names.transitions
    table("_ON", [f"_on_{event}" for event in names.events])
    table("_PORTS", [f"_port_{event}" for event in names.events])
    table("_EXITED", [f"_exited_{state}" for state in states])
    table("_ENTERED", [f"_entered_{state}" for state in states])
    if "_INVOKE" in shared.constants:
        table("_INVOKE", [f"_invoke_{state}" for state in states])
        table("_FINALIZE", [f"_finalize_{event}" for event in names.events])
    for name, verb in (
        ("_LEAVE", "leave"),
        ("_DO", "do"),
        ("_ENTER", "enter"),
        ("_GUARDS", "guard"),
    ):
        table(name, [f"_{verb}_{transition}" for transition in transitions])
