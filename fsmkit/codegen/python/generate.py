"""A chart as a Python module. This file is the table of contents of the generated text."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator

from fsmkit.chart.chart import Chart
from fsmkit.chart.content import functions_called
from fsmkit.codegen.definitions import reached
from fsmkit.codegen.python import (
    coverage,
    invoking,
    movement,
    plain,
    recording,
    relations,
    saving,
    sending,
    template,
)
from fsmkit.codegen.python.content import ContentPrinter, Needs
from fsmkit.codegen.python.expressions import spell
from fsmkit.codegen.python.family import Member, family_of, is_alone
from fsmkit.codegen.python.head import print_head, print_start, wrapped
from fsmkit.codegen.python.lines import Lines, Piece, Uses
from fsmkit.codegen.python.linking import LINK, ME, resolve_links
from fsmkit.codegen.python.names import Names, members_of
from fsmkit.codegen.python.selection import (
    bit,
    is_needing_memo,
    print_selection,
)
from fsmkit.codegen.python.straight import Straight
from fsmkit.codegen.python.trees import Trees
from fsmkit.codegen.python.trimming import facts_of
from fsmkit.emit import printing
from fsmkit.emit.python import paragraph, source_name
from fsmkit.plan import Plan, lower
from fsmkit.plan.counting import area_of, counted
from fsmkit.plan.image import Image
from fsmkit.runtime.tracing.numbering import Numbering

HEADER = '''\
"""{doc}

Made by fsmkit from {source}: change that, not this. Times are ticks of {tick} us, modulo 2^32.
"""

from __future__ import annotations

{imports}from collections.abc import {abstract}
from enum import IntEnum
{tools}from typing import Any, ClassVar, Protocol
'''
CONSTANTS = {"CLOCK": "0xFFFFFFFF", "FAR": "0x80000000", "NOTHING": "-1"}


@printing
def module_text(
    chart: Chart,
    *,
    traced: bool = False,
    prefix: str | None = None,
    saved: bool = False,
    recorded: bool = False,
    covered: bool = False,
) -> str:
    """Return the text of the module: the same for the same chart. ``prefix`` names the class.

    ``saved``: the machine can be saved and restored; ``recorded``: it makes records; ``covered``:
    it counts what tests reach. Without a trace there is no `trace` to set, and nothing is spent on
    it; machines that invoke others, and those that count, always have it.
    """
    family = family_of(counted(chart) if covered else chart, prefix)
    if covered:
        coverage.require_names(family)
    members = tuple(family.everyone)
    shared = (
        template.machine(saved=saved, recorded=recorded)
        if is_alone(chart)
        else template.invoking(saved=saved, recorded=recorded, covered=covered)
    )
    numbering = Numbering(chart) if recorded else None
    plans = tuple(lower(member.chart) for member in members)
    needs = tuple(Needs() for _ in members)
    is_told = traced or covered
    pairs = zip(members, plans, needs, strict=True)
    classes = [
        _class(*pair, shared, traced=is_told, saved=saved, numbering=numbering, covered=covered)
        for pair in pairs
    ]
    parts = [*([] if shared.bases is None else [shared.bases]), *classes]
    names = {name for part in parts for name in part.outside}
    arithmetic = template.arithmetic(names)
    names |= {name for part in arithmetic for name in part.outside}
    own = [_bits(plan, member.names) for member, plan in zip(members, plans, strict=True)]
    values = _values(family.names)
    constants = [Piece(name, f"{name} = {value}") for name, value in CONSTANTS.items()]
    used = reached([*constants, *values, *(piece for each in own for piece in each)], names)
    pieces = (
        _header(chart, names) + _text(constants, used),
        *enumerations(family.names),
        _text(values, used),
        *(_text(each, used) for each in own),
        *(piece.text for piece in arithmetic),
        host(family.names, list(zip(members, needs, strict=True))),
        *(piece.text for piece in parts),
        *(["\n".join(map(coverage.area_text, members))] if covered else []),
    )
    return resolve_links("\n\n\n".join(piece.strip("\n") for piece in pieces if piece) + "\n")


def _text(constants: Iterable[Piece], used: Collection[str]) -> str:
    return "".join(f"\n{constant.text}" for constant in constants if constant.name in used)


def _class(
    member: Member,
    plan: Plan,
    needs: Needs,
    shared: template.Template,
    *,
    traced: bool,
    saved: bool,
    numbering: Numbering | None,
    covered: bool,
) -> Piece:
    """Return a class: complete if it is the only machine, else derived from the shared base."""
    chart, names = member.chart, member.names
    is_recorded = numbering is not None
    image = Image(plan) if saved or is_recorded else None
    content = ContentPrinter(chart, names, needs)
    is_alone = shared.bases is None
    is_traced = traced or is_recorded or not is_alone
    is_plain = not is_traced and plain.is_plain(plan)
    first = area_of(chart).first_transition if covered else None
    needs.is_covered = covered
    body = Lines(1, is_traced=is_traced, is_recorded=is_recorded, first_transition=first)
    answered = _moves(body, plan, names, content, is_seen=is_traced)
    _guards(body, chart, names)
    if covered:
        coverage.print_counting(body, member)
    if is_plain:
        plain.print_dispatch(body, has_payload=plan.features.payload)
    if not is_alone:
        invoking.print_invocations(body, plan, member, content)
    elif not (is_traced or plan.features.follows):
        _print_settle(body, plan)
    sending.print_senders(body, chart, names, needs, answered if is_plain else None)
    called = functions_called(chart)
    for function in chart.functions:
        if function.name in called:
            content.function(body, function)
    _conditions(body, needs)
    if image is not None:
        saving.print_histories(body, image, names)
    _tables(body, names, shared)
    start = Lines(1)
    print_start(start, plan, member, needs, is_alone=is_alone)
    own = [*start.pieces(), *body.pieces()]
    tables = saving.constants(image, names, needs) if image is not None else {}
    if numbering is not None:
        tables |= recording.constants(chart, numbering, names)
    head = Lines(1)
    if not is_alone:
        print_head(head, plan, member, needs, shared, tables, None)
        text = "\n".join(piece.text for piece in own)
        opening = f"class {names.machine}({template.BASES[1]}):"
        return Piece(names.machine, f"{opening}\n{head.finish()}{text}")
    facts = facts_of(
        plan.features,
        image,
        traced=is_traced,
        recorded=is_recorded,
        covered=covered,
        saved=saved,
    )
    methods, used = shared.trimmed(facts, own)
    print_head(head, plan, member, needs, shared, tables, used)
    kept = [*start.pieces(), *methods, *body.pieces()]
    kept = [piece for piece in kept if piece.name in used]
    text = "\n".join(piece.text for piece in kept)
    outside = frozenset(name for piece in kept for name in piece.read.outside)
    table = f"\n\n\n{plain.print_table(chart, names, answered)}" if is_plain else ""
    whole = f"class {names.machine}:\n{head.finish()}{text}{table}"
    return Piece(names.machine, whole, Uses(outside=outside))


def _print_settle(out: Lines, plan: Plan) -> None:
    """Print the end of a step after which no further event can follow."""
    with out.method("_settle", "Nothing follows an event that is taken."):
        if plan.features.error_faults:
            with out.suite(f"if {ME}_fault is not None:"):
                out.line(f"{ME}_running = {ME}_finished = False")


def _header(chart: Chart, names: Collection[str]) -> str:
    used = [name for name in ("binascii", "math", "struct", "zlib") if name in names]
    iterates = "islice" in names
    source = source_name(chart.sources[0].name) if chart.sources else "a chart"
    doc = chart.doc or "The machine " + chart.name + "."
    return HEADER.format(
        doc=paragraph(doc),
        source=source,
        tick=chart.capacities.tick,
        imports="".join(f"import {name}\n" for name in used),
        abstract="Callable, Iterator" if "Iterator" in names else "Callable",
        tools="from itertools import islice\n" if iterates else "",
    )


def enumerations(names: Names) -> Iterator[str]:
    """Print the enumerations that the machines of the module declare."""
    for type_, name in names.enumerations.items():
        out = Lines()
        with out.suite(f"class {name}(IntEnum):"):
            out.line('"""An enumeration of the chart."""')
            out.line()
            for member, number in zip(members_of(type_), type_.numbers, strict=True):
                out.line(f"{member} = {number}")
        yield out.finish()


def _values(names: Names) -> list[Piece]:
    """Return the members of enumerations as plain integers, which a step computes with."""
    return [
        Piece(
            resolve_links(name), f"{resolve_links(name)} = {names.enumerations[type_]}.{own}.value"
        )
        for (type_, value), name in names.members.items()
        for own, number in zip(members_of(type_), type_.numbers, strict=True)
        if number == value
    ]


def _bits(plan: Plan, names: Names) -> list[Piece]:
    """Return the constants of a chart: its own, a bit for each state, and its timers."""
    literals = (literal for _, literal in plan.chart.constants)
    pairs = zip(names.constants.values(), literals, strict=True)
    texts = {name: spell(literal.value, literal.type) for name, literal in pairs}
    texts |= {name: bit(number) for number, name in enumerate(names.states)}
    if plan.is_single:
        texts |= relations.configurations(plan, names)
    texts |= {name: str(index) for index, name in names.timers.items()}
    return [
        Piece(resolve_links(name), f"{resolve_links(name)} = {text}")
        for name, text in texts.items()
    ]


def host(names: Names, members: list[tuple[Member, Needs]]) -> str:
    """Return the requirements of all machines of the module on the host."""
    methods = {
        method[0]: method
        for member, needs in members
        for method in sending.host_methods(member.chart, member.names, needs)
    }
    if not methods:
        return ""
    out = Lines()
    with out.suite(f"class {names.machine}Host(Protocol):"):
        out.line('"""The host of the machine: methods of a subclass, or of an object."""')
        for name, passed, result, doc in methods.values():
            with out.method(name, doc, ", ".join(passed), result):
                out.line("...")
    return out.finish()


def _moves(
    out: Lines, plan: Plan, names: Names, content: ContentPrinter, *, is_seen: bool
) -> set[int]:
    """Print the handlers of events, eventless transitions and timeouts; return handled events."""
    if not print_selection(out, names, plan.selection, "_select_eventless", None):
        with out.method("_select_eventless", "There are no eventless transitions.", result="int"):
            out.line("return 0")
    mover = movement.Mover(out, plan, names, content)
    trees = Trees(out, plan, names, mover, is_seen)
    straight = Straight(out, plan, names, content, mover, trees, plan.selection, is_seen)
    straight.events()
    mover.states()
    mover.transitions(straight.apart)
    trees.print()
    return straight.answered


def _guards(out: Lines, chart: Chart, names: Names) -> None:
    from fsmkit.codegen.python.expressions import Printer
    from fsmkit.plan.features import payload_of

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
    is_timed = transition.timer is not None
    return transition.guard is not None and (is_timed or is_needing_memo(chart, transition))


def place_of(chart: Chart, index: int) -> str:
    """Return the kind of a transition and its source location."""
    return relations.describe(chart, chart.transitions[index])


def _conditions(out: Lines, needs: Needs) -> None:
    for number, text in enumerate(needs.conditions):
        with out.method(
            f"_holds_{number}", "A condition; false if it cannot be evaluated.", result="bool"
        ):
            with out.suite("try:"):
                out.line(f"held: bool = {text}")
                out.line("return held")
            with out.suite(f"except {LINK}ContentError:"):
                out.line(f"{ME}_error_execution()")
                out.line("return False")


def _tables(out: Lines, names: Names, shared: template.Template) -> None:
    defined = {piece.name for piece in out.pieces()}

    def table(name: str, methods: list[str]) -> None:
        entries = [LINK + m if m in defined else "None" for m in methods]
        out.piece(name)
        out.line()
        wrapped(out, f"{name}: {shared.constants[name]} = (", entries, ")")

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
