"""Report the differences between a machine of the library and its chart."""

from __future__ import annotations

from fsmkit.diagnostics import Findings, Span
from fsmkit.foreign.pytransitions.callbacks import Placement, before
from fsmkit.foreign.pytransitions.moves import Moves, is_below
from fsmkit.foreign.pytransitions.names import called_names
from fsmkit.foreign.pytransitions.spec import Callbacks, State, Step, milliseconds


def report(moves: Moves, placement: Placement, findings: Findings) -> bool:
    """Report differences and inexpressible parts; return whether a chart can express all."""
    reporter = _Reporter(moves, findings)
    reporter.states()
    reporter.steps()
    if not findings.has_errors:
        reporter.several()
        reporter.scopes()
    reporter.callbacks(placement)
    reporter.settings()
    return not findings.has_errors


class _Reporter:
    def __init__(self, moves: Moves, findings: Findings) -> None:
        self._moves = moves
        self._machine = moves.machine
        self._findings = findings

    def _reject(self, message: str, at: Span, advice: str, *others: tuple[Span, str]) -> None:
        self._findings.add("beyond-statecharts", message, at, secondary=others, help=advice)

    def _name(self, step: Step) -> str:
        join = self._machine.separator.join
        dest = "" if step.dest is None else f" to `{join(step.dest)}`"
        return f"`{step.trigger}` from `{join(step.source)}`{dest}"

    # --- states -----------------------------------------------------------------------------

    def states(self) -> None:
        """Report states that the library enters in its own way."""
        for state in self._machine.walk():
            if state.is_parallel and set(state.initial) != {c.path[-1] for c in state.children}:
                left_out = [c for c in state.children if c.path[-1] not in state.initial]
                self._reject(
                    f"`{state.path[-1]}` is entered with some of its children, not with all",
                    state.span,
                    "put them into regions: in a chart all children are active, or one is",
                    *((c.span, "this one is not") for c in left_out),
                )
            self._timeout(state)
        self._initial_states()

    def _timeout(self, state: State) -> None:
        if state.timeout is None:
            return
        try:
            milliseconds(state.timeout)
        except ValueError:
            self._findings.add(
                "unexpected-value", f"`timeout` is seconds, not `{state.timeout}`", state.timeout,
                help="write a number above 0",
            )  # fmt: skip

    def _initial_states(self) -> None:
        """Report an initial configuration that a chart cannot have."""
        whole = Span(self._machine.source, 0, 0)
        begun = self._machine.initial
        advice = "start in a state with `parallel`, which holds all of them"
        if len(begun) > 1 and any(self._moves.states[path].children for path in begun):
            self._reject("the machine starts in states without their children", whole, advice)
        above = {path[:length] for path in begun for length in range(len(path))}
        active = above | set(begun)
        for path in above:
            inside = [each for each in active if each[:-1] == path and each]
            regions = self._moves.states[path].children if self._moves.is_parallel(path) else ()
            if len(inside) != max(1, len(regions)):
                what = "some regions, not in all" if regions else "several states"
                self._reject(f"the machine starts in {what}", whole, advice)

    # --- single steps -------------------------------------------------------------------------

    def steps(self) -> None:
        """Report steps that no transition of a chart makes."""
        for step in self._machine.steps:
            difference = self._moves.difference(step)
            if difference is not None:
                self._reject(
                    f"{self._name(step)} {difference}: no transition of a chart does",
                    step.span,
                    "lead to a state beside the source, to a child of it, or to one around it",
                )

    # --- several steps on one trigger ---------------------------------------------------------

    def several(self) -> None:
        """Report triggers on which the library takes other steps than a chart."""
        for one, two in self._moves.pairs():
            if self._moves.is_orthogonal(one.source, two.source):
                self._both(one, two)
            elif is_below(two.source, one.source):
                self._around(one, two)

    def _around(self, outer: Step, inner: Step) -> None:
        is_moving = outer.dest is not None and inner.dest is not None
        if not is_moving and self._moves.is_parallel_between(outer.source, inner.source):
            self._reject(
                f"the library makes only one of two steps on `{outer.trigger}`, a chart both",
                outer.span,
                "let only one of them react to it, or give both a destination",
                (inner.span, "this one"),
            )
        elif outer.is_conditional and self._moves.is_parallel_between(outer.source, inner.source):
            self._findings.add(
                "callback-order",
                f"on `{outer.trigger}` the chart may ask the conditions of the outer state too",
                outer.span,
                secondary=[(inner.span, "though this step is made")],
                help="let conditions only answer, and change nothing",
            )

    def _both(self, one: Step, two: Step) -> None:
        moves = self._moves
        stays = moves.stays_in_region(one, two.source), moves.stays_in_region(two, one.source)
        if not all(stays):
            self._reject(
                f"`{one.trigger}` leaves a parallel state, and the library then still makes the "
                "step of another region",
                (two if stays[0] else one).span,
                "let only one region react to it",
                ((one if stays[0] else two).span, "this one"),
            )
        elif self._reads_conditions(one) and self._reads_conditions(two):
            self._findings.add(
                "callback-order",
                f"on `{one.trigger}` the library finishes one region before the other",
                one.span,
                secondary=[(two.span, "and this one")],
                help="in the chart all conditions come first, then all exits, all transitions, "
                "all entries",
            )

    def _reads_conditions(self, step: Step) -> bool:
        moves = self._moves
        return bool(
            step.is_conditional or before(moves, step) or step.after
            or any(s.on_exit for s in moves.exits(step))
            or any(s.on_enter for s in moves.entries(step))
        )  # fmt: skip

    def scopes(self) -> None:
        """Report steps in descriptions of states that the library tries too early, or twice."""
        steps = self._machine.steps
        for one in steps:
            inner = [
                two
                for two in steps
                if two.trigger == one.trigger
                and len(two.scope) > len(one.scope)
                and is_below(one.source, two.source)
            ]
            for two in inner[:1]:
                self._reject(
                    f"{self._name(two)} comes before that of an inner state, because it stands in "
                    "a description",
                    two.span, "move it to the transitions of the machine",
                    (one.span, "before this one"),
                )  # fmt: skip
            if self._moves.is_parallel(one.scope) and self._can_follow(one):
                self._reject(
                    f"{self._name(one)} can be made twice on one trigger, because it stands in the "
                    "description of a parallel state",
                    one.span, "move it to the transitions of the machine",
                )  # fmt: skip

    def _can_follow(self, two: Step) -> bool:
        """Return whether a step can follow another one, or itself, on the same trigger."""
        for one in self._machine.steps:
            if one.trigger != two.trigger or one.scope != two.scope:
                continue
            dest = one.source if one.dest is None else one.dest
            is_again = two.source == dest or is_below(dest, two.source)
            if (one is two and one.dest is None) or (
                one.dest is not None and (is_again or is_below(two.source, dest))
            ):
                return True
        return False

    # --- callbacks ----------------------------------------------------------------------------

    def callbacks(self, placement: Placement) -> None:
        """Report callbacks whose order changes, or that are omitted."""
        for step in placement.confused:
            self._findings.add(
                "callback-order",
                f"{self._name(step)} calls the exits in another order than the library",
                step.span,
                help="in a chart the content of a transition comes after all exits, and of two "
                "regions the later one is left first",
            )
        general = self._machine.general
        is_conditional = any(step.is_conditional for step in self._machine.steps)
        if is_conditional:
            self._dropped("prepare_event", general["prepare_event"], "before conditions")
        self._dropped("finalize_event", general["finalize_event"], "after each trigger")
        self._dropped("on_exception", general["on_exception"], "on errors of other callbacks")
        for step in self._machine.steps:
            if step.is_conditional:
                self._dropped("prepare", step.prepare, "before conditions")
        for state in self._machine.walk():
            self._dropped(
                "on_final",
                self._moves.region_finals(state),
                "when all regions have ended",
            )

    def _dropped(self, kind: str, callbacks: Callbacks, when: str) -> None:
        for text in callbacks:
            self._findings.add(
                "callback-left-out",
                f"`{kind}` calls `{text}` {when}: a chart has no place for that",
                text,
                help="it is omitted; call it in another callback, for instance in `before`",
            )

    # --- the machine --------------------------------------------------------------------------

    def settings(self) -> None:
        """Report unsupported settings of the machine."""
        machine = self._machine
        changes = []
        if not machine.queued and any(called_names(machine)):
            changes.append("an event that a callback triggers is taken after the step (`queued`)")
        if not machine.ignores_invalid:
            changes.append("an event without a transition is counted, not an exception")
        if machine.has_automatic:
            changes.append("the automatic `to_<state>` are omitted")
        if changes:
            self._findings.add(
                "machine-setting", f"in the chart {'; '.join(changes)}", Span(machine.source, 0, 0),
                help="nothing, if the machine is not used otherwise",
            )  # fmt: skip
