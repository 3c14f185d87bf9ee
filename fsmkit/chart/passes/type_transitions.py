"""Type the transitions: their events, delays, guards and content."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

from fsmkit.chart.chart import OPEN_ENDED, Transition
from fsmkit.chart.copies.splicing import Spliced
from fsmkit.chart.passes.collect_events import Events
from fsmkit.chart.passes.context import Context
from fsmkit.chart.passes.number_states import Tree
from fsmkit.chart.passes.resolve_targets import Arrow, Arrows
from fsmkit.chart.passes.type_content import type_block, type_condition
from fsmkit.diagnostics import Findings, Text
from fsmkit.diagnostics.fixes import replace_text
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.document import keys
from fsmkit.document.document import DocTransition, Trigger
from fsmkit.language import BOOL, Expr, Literal, read_duration
from fsmkit.language.durations import format_ticks

CARRIED = keys.kept_keys(keys.TRANSITION, Transition)
TIMED = (Trigger.AFTER, Trigger.EVERY)
PLAIN_DELAY = re.compile(r"[0-9]+(\.[0-9]+)?[a-z]+")
"""A number with a unit, which a drawing may show unchanged."""


def type_transitions(arrows: Arrows, context: Context) -> tuple[Transition, ...]:
    """Return the transitions of a chart, in document order."""
    known: dict[tuple[Trigger, tuple[int, ...]], Context] = {}
    timers = _timers(arrows)
    return tuple(_transition(arrow, context, known, timers) for arrow in arrows.all)


def _timers(arrows: Arrows) -> dict[int, int]:
    """Return the timer of each timed transition, by their numbers.

    Transitions of one state with the same key and the same delay, as written, share the timer of
    the first of them: as under `on`, the first enabled one is taken.
    """
    first: dict[tuple[int, Trigger, str], int] = {}
    found = {}
    for arrow in arrows.all:
        written = arrow.written
        if written.trigger in TIMED and written.delay is not None:
            key = arrow.source, written.trigger, "".join(written.delay.value.split())
            found[arrow.index] = first.setdefault(key, arrow.index)
    return found


def with_copies(
    transitions: tuple[Transition, ...], arrows: Arrows, tree: Tree, copies: Spliced
) -> tuple[Transition, ...]:
    """Return the transitions, those of copies as they are in the used charts."""
    made = tuple(
        _with_copy(made, arrow, tree, copies)
        for made, arrow in zip(transitions, arrows.all, strict=True)
    )
    copied = {
        (tree.nodes[arrow.source].state.copy, arrow.copied): arrow.index for arrow in arrows.all
    }
    return tuple(
        one
        if arrow.copied is None or one.timer is None
        else replace(one, timer=copied[tree.nodes[arrow.source].state.copy, one.timer])
        for one, arrow in zip(made, arrows.all, strict=True)
    )


def _with_copy(typed: Transition, arrow: Arrow, tree: Tree, copies: Spliced) -> Transition:
    state = tree.nodes[arrow.source].state
    if state.copy is None:
        return typed
    if typed.trigger is Trigger.INITIAL and state.copied is None:
        typed = replace(typed, content=(*copies.resets(state.copy), *typed.content))
    return typed if arrow.copied is None else copies.transition(typed, state.copy, arrow.copied)


def _transition(
    arrow: Arrow,
    context: Context,
    known: dict[tuple[Trigger, tuple[int, ...]], Context],
    timers: Mapping[int, int],
) -> Transition:
    """Return a transition; ``known``: the contexts of earlier ones, by trigger and events.

    ``timers``: the timer of each timed transition.
    """
    written = arrow.written
    at = context.at(arrow.source)
    if arrow.copied is not None:  # another pass copies it
        return Transition(
            arrow.index, arrow.source, written.trigger, (), (), None, arrow.targets,
            internal=False, content=(), span=written.span,
        )  # fmt: skip
    events = match_events(written, context)
    here = known.get((written.trigger, events)) if at is context else None
    if here is None:
        here = transition_context(written, events, at)
    if at is context:
        known[written.trigger, events] = here
    context = at
    least, delay = _delays(written, context)
    return Transition(
        index=arrow.index,
        source=arrow.source,
        trigger=written.trigger,
        events=events,
        descriptors=tuple(e.value for e in written.events),
        guard=_guard(written, here),
        targets=arrow.targets,
        content=type_block(written.content or (), here),
        span=written.span,
        delay=delay,
        delay_name=_delay_name(written, context),
        delay_text=_delay_text(written),
        least=least,
        timer=timers.get(arrow.index),
        origin=written.origin,
        **keys.values(written, CARRIED),
    )


def match_events(written: DocTransition, context: Context) -> tuple[int, ...]:
    """Return the indices of the events a transition matches, in the order of events."""
    if written.trigger is not Trigger.EVENT:
        return ()
    found: set[int] = set()
    for descriptor in written.events:
        matching = context.events.matching(descriptor.value)
        found.update(matching)
        if not matching and not context.is_loose:
            _unknown_event(descriptor.value, written, context.events, context.findings)
    return tuple(sorted(found))


def _unknown_event(name: str, written: DocTransition, events: Events, findings: Findings) -> None:
    known = [event.name for event in events.all]
    at = next(e for e in written.events if e.value == name)
    if name.startswith("done.state."):
        otherwise = "only a state with a final child is ever done"
    else:
        otherwise = f"declare `{name}` under `events`"
    findings.add(
        "unknown-name", f"there is no event `{name}`", at, help=suggest(name, known, otherwise)
    )


def transition_context(
    written: DocTransition, events: tuple[int, ...], context: Context
) -> Context:
    """Return the context of a transition on `events`, with their common fields and reply types.

    In a loose dialect `_event` is the last event everywhere (SCXML 5.10.1). Its payload is known
    only in a transition that an event triggers.
    """
    if written.trigger is not Trigger.EVENT:
        return context
    fields = context.events.common_fields(events)
    replies = [context.events.all[i].reply for i in events]
    return replace(
        context,
        scope=replace(
            context.scope, event_fields=fields, event_facts=context.events.common_facts(events)
        ),
        replies=tuple(r for r in replies if r is not None),
    )


def _guard(written: DocTransition, context: Context) -> Expr | None:
    if written.guard is None or not written.super_guards:
        return None if written.guard is None else type_condition(written.guard, context)
    inner: Expr | None = None
    for text in reversed(written.super_guards):
        if text is None:
            inner = Literal(True, BOOL, written.guard.span)
            continue
        scope = replace(context.scope, super_guard=inner)
        inner = type_condition(text, replace(context, scope=scope))
    scope = replace(context.scope, super_guard=inner)
    return type_condition(written.guard, replace(context, scope=scope))


def _delays(written: DocTransition, context: Context) -> tuple[int | None, int]:
    """Return the delay of a timed transition, in ticks; of an interval the least one before it."""
    text = written.delay
    if written.trigger not in TIMED or text is None:
        return None, 0
    low, dots, _ = text.value.partition("..")
    if not dots:
        return None, _delay(written, text, context)
    least = _delay(written, text.part(0, len(low)).strip(), context)
    rest = text.part(len(low) + len(dots), len(text.value)).strip()
    greatest = _delay(written, rest, context) if rest.value else least + OPEN_ENDED
    if written.trigger is Trigger.EVERY:
        context.findings.add(
            "bad-delay", "`every` takes one delay", text,
            help="use `after`, and enter the state again",
        )  # fmt: skip
    elif greatest < least:
        context.findings.add(
            "bad-delay", "the greatest delay is less than the least", text, help="swap the two",
            fixes=replace_text(text, f"{rest}..{text.part(0, len(low)).strip()}"),
        )  # fmt: skip
    elif not rest.value and least >= OPEN_ENDED:
        context.findings.add(
            "bad-delay", "the least delay of an open interval must be less than 2^30 ticks", text,
            help="choose a longer `tick`",
        )  # fmt: skip
    return (None if least == greatest else least), greatest


def _delay_name(written: DocTransition, context: Context) -> str | None:
    name = None if written.delay is None else written.delay.value
    return name if name in context.scope.constants else None


def _delay_text(written: DocTransition) -> str | None:
    text = "" if written.delay is None else written.delay.value.strip()
    return text if PLAIN_DELAY.fullmatch(text) else None


def _delay(written: DocTransition, text: Text, context: Context) -> int:
    ticks = read_duration(text, context.scope, context.findings)
    if ticks is None:
        return 0
    if ticks <= 0 and written.trigger is Trigger.EVERY:
        context.findings.add(
            "bad-delay",
            "`every` with a delay of 0 would never let time pass",
            text,
            help="write a delay of one tick at least",
            fixes=replace_text(text, format_ticks(1, context.scope.tick)),
        )
    return ticks
