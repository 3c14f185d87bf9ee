"""Change inherited transitions, field by field, and add own ones around them."""

from __future__ import annotations

from dataclasses import replace

from fsmkit.diagnostics import Findings
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.document import keys
from fsmkit.document.document import DocState, DocTransition, Origin, Trigger
from fsmkit.document.walk import map_parts, parts
from fsmkit.language.statements.tree import Block, Super


def override_transitions(
    base: DocState, entry: DocState, findings: Findings
) -> tuple[DocTransition, ...]:
    """Return the transitions of a refined state in order of priority.

    Own ones marked ``first``, then the inherited (changed where an entry overrides them), then
    the other own ones.
    """
    inherited = list(base.transitions)
    for written in entry.transitions:
        if written.override is None:
            continue
        index = _find(base, entry, written, findings)
        if index is None:
            continue
        if inherited[index].origin is Origin.OVERRIDDEN:
            findings.add(
                "override-of-nothing",
                "an inherited transition is overridden twice",
                written.override,
                secondary=[(inherited[index].span, "the first")],
                help="join the two",
            )
            continue
        inherited[index] = _changed(inherited[index], written)
    own = [t for t in entry.transitions if t.override is None]
    first = [t for t in own if t.first]
    return (*first, *inherited, *(t for t in own if not t.first))


def _find(
    base: DocState, entry: DocState, written: DocTransition, findings: Findings
) -> int | None:
    """Return the index of the overridden transition, found by its id or by its trigger.

    Several of one trigger, such as those of a choice, are overridden together, in their order.
    """
    override = written.override
    assert override is not None  # noqa: S101  (the caller has looked)
    name = override.value
    if name != "true":
        ids = [t.id.value if t.id is not None else "" for t in base.transitions]
        if name in ids:
            index = ids.index(name)
            if _has_trigger(written) and not same_trigger(base.transitions[index], written):
                findings.add(
                    "forbidden-change",
                    f"transition `{name}` cannot be given another trigger",
                    written.span,
                    secondary=[(base.transitions[index].span, "the inherited transition")],
                    help="keep the trigger; add a transition of your own for another event",
                )
            return index
        findings.add(
            "override-of-nothing",
            f"`{base.id}` inherits no transition `{name}`",
            override,
            secondary=[(base.span, "the inherited state")],
            help=suggest(name, filter(None, ids), "name the `id` of an inherited transition"),
        )
        return None
    matching = [i for i, t in enumerate(base.transitions) if same_trigger(t, written)]
    together = [t for t in entry.transitions if _is_marked(t) and same_trigger(t, written)]
    if len(matching) == len(together):
        return matching[next(n for n, each in enumerate(together) if each is written)]
    if len(matching) == 1:
        return matching[0]
    if not matching:
        findings.add(
            "override-of-nothing",
            f"`{base.id}` inherits no transition {_describe(written)}",
            override,
            secondary=[(base.span, "the inherited state")],
            help="remove `override`, or give the trigger as the base writes it",
        )
    else:
        findings.add(
            "ambiguous-override",
            f"`{base.id}` inherits {len(matching)} transitions {_describe(written)}",
            override,
            secondary=[(base.transitions[i].span, "one of them") for i in matching],
            help=f"override all {len(matching)} in their order; "
            "or give one of them an `id` in the base, and write `override: <id>`",
        )
    return None


def _is_marked(transition: DocTransition) -> bool:
    return transition.override is not None and transition.override.value == "true"


def same_trigger(first: DocTransition, second: DocTransition) -> bool:
    """Whether two transitions have the same trigger, as written."""
    return (
        first.trigger is second.trigger
        and {e.value for e in first.events} == {e.value for e in second.events}
        and (first.delay and first.delay.value) == (second.delay and second.delay.value)
    )


def _has_trigger(transition: DocTransition) -> bool:
    return transition.trigger is not Trigger.EVENTLESS


def _describe(transition: DocTransition) -> str:
    """Return the trigger of a transition for a message, as ``on `go```."""
    match transition.trigger:
        case Trigger.EVENT:
            return "on " + " ".join(f"`{e}`" for e in transition.events)
        case Trigger.AFTER | Trigger.EVERY:
            return f"`{transition.trigger.value} {transition.delay}`"
        case _:
            return "without an event"


def _changed(base: DocTransition, written: DocTransition) -> DocTransition:
    """Return an inherited transition with the fields that are given."""
    content = base.content
    if written.content is not None:
        content = insert_super(written.content, base.content or ())
    super_guards = base.super_guards
    if written.guard is not None:
        super_guards = (base.guard, *base.super_guards)
    return replace(
        base,
        span=written.span,
        super_guards=super_guards,
        content=content,
        origin=Origin.OVERRIDDEN,
        **keys.merge_fields(base, written, keys.TRANSITION),
    )


def holds_super(block: Block) -> bool:
    """Whether ``super`` stands somewhere in these statements."""
    return any(isinstance(part, Super) for part in parts(block))


def insert_super(block: Block, base: Block) -> Block:
    """Return statements in which those of the base replace ``super``."""
    inserted: Block = map_parts(block, lambda part: base if isinstance(part, Super) else None)
    return inserted
