"""Leaving and entering states, and the content on the way."""

from __future__ import annotations

from fsmkit.codegen.python.content import ContentPrinter
from fsmkit.codegen.python.expressions import parts_of
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.python.moves import (
    Decision,
    Entry,
    Recorded,
    default_entry,
    effective_defaults,
    entry_of,
    possible_domains,
    real_below,
    real_children,
    static_domain,
)
from fsmkit.codegen.python.names import Names
from fsmkit.codegen.python.selection import has_regions, mask, payload_of
from fsmkit.expressions import Storage, Variable
from fsmkit.model.chart import Chart, State, Transition
from fsmkit.model.document import Kind, Trigger

TIMED = (Trigger.AFTER, Trigger.EVERY)


def print_moves(out: Lines, chart: Chart, names: Names, content: ContentPrinter) -> None:
    """Print everything that changes the configuration."""
    mover = _Mover(out, chart, names, content)
    mover.begin()
    for state in chart.states[1:]:
        if not state.is_history:
            mover.exited(state)
            mover.entered(state)
    for transition in chart.transitions:
        if transition.trigger is not Trigger.INITIAL:
            mover.taken(transition)
    if has_regions(chart) and any(is_dynamic(chart, t) for t in chart.transitions):
        mover.clashes()


def is_dynamic(chart: Chart, transition: Transition) -> bool:
    """Whether the domain of a transition depends on what a history holds."""
    has_domain = transition.trigger is not Trigger.INITIAL and bool(transition.targets)
    return has_domain and static_domain(chart, transition) is None


def describe(chart: Chart, transition: Transition) -> str:
    """Return ``feeder.yaml:31 idle -> pushing on arrived``."""
    match transition.trigger:
        case Trigger.EVENT:
            cause = "on " + " ".join(transition.descriptors)
        case Trigger.EVENTLESS:
            cause = "always"
        case trigger:
            cause = f"{trigger.value} {transition.delay}"
    targets = ", ".join(chart.states[target].id for target in transition.targets)
    arrow = f"-> {targets} " if targets else ""
    source = chart.states[transition.source].id
    text = f"{_line(transition)}{source} {arrow}{cause}"
    return text.replace("\\", "/").replace('"', "'")


def _line(transition: Transition) -> str:
    span = transition.span
    if not span.source.text:
        return ""
    name = span.source.name.replace("\\", "/").split("/")[-1]
    return f"{name}:{span.source.position(span.start)[0]} "


def samples_inputs(chart: Chart) -> bool:
    """Whether the guard of an eventless transition reads an input."""
    return any(t.trigger is Trigger.EVENTLESS and _reads_input(t.guard) for t in chart.transitions)


def _reads_input(node: object) -> bool:
    is_input = isinstance(node, Variable) and node.storage is Storage.INPUT
    return is_input or any(map(_reads_input, parts_of(node)))


def conflict_tables(chart: Chart) -> dict[str, object]:
    """Return for each transition those whose sources lie outside its own, and those it meets.

    Exit sets meet where one domain is the other or an ancestor of it: both are active and compound.
    """
    if not has_regions(chart):
        return {}
    size = len(chart.transitions)
    outer = [
        sum(1 << u.index for u in chart.transitions if chart.is_descendant(t.source, u.source))
        for t in chart.transitions
    ]
    clashes = [0] * size
    for t in chart.transitions:
        for u in chart.transitions:
            if t.targets and u.targets and not {Trigger.INITIAL} & {t.trigger, u.trigger}:
                a, b = static_domain(chart, t), static_domain(chart, u)
                if a is not None and b is not None and _is_related(chart, a, b):
                    clashes[t.index] |= 1 << u.index
    return {"OUTER": tuple(outer), "CLASHES": tuple(clashes)}


def _is_related(chart: Chart, a: int, b: int) -> bool:
    return a == b or chart.is_descendant(a, b) or chart.is_descendant(b, a)


class _Mover:
    def __init__(self, out: Lines, chart: Chart, names: Names, content: ContentPrinter) -> None:
        self._out = out
        self._chart = chart
        self._names = names
        self._content = content

    def begin(self) -> None:
        """Print what `start` does."""
        initial = self._chart.root.initial
        assert initial is not None  # noqa: S101
        entry = self._chart.transitions[initial]
        with self._out.method("_begin", "Run the script and enter the initial states."):
            self._content.block(self._out, self._chart.script, None)
            self._content.block(self._out, entry.content, None)
            self._enter(entry_of(self._chart, entry.targets, 0))

    # --- states -----------------------------------------------------------------------------

    def exited(self, state: State) -> None:
        """Print what happens when a state is left, if anything does."""
        timed = self._timed(state)
        blocks = [block for block in state.on_exit if block]
        if not timed and not blocks:
            return
        with self._out.method(
            f"_exited_{self._names.states[state.index]}", f"On leaving {state.id}."
        ):
            for transition in timed:
                self._out.line(f"self._disarm({transition.index})")
            self._content.blocks(self._out, tuple(blocks), None)

    def entered(self, state: State) -> None:
        """Print what happens when a state is entered, if anything does."""
        timed = self._timed(state)
        blocks = tuple(block for block in state.on_entry if block)
        defaults = self._defaults(state)
        if not timed and not blocks and not defaults and state.kind is not Kind.FINAL:
            return
        name = f"_entered_{self._names.states[state.index]}"
        with self._out.method(name, f"On entering {state.id}.", "defaults: int"):
            if not defaults:
                self._out.line("del defaults")
            for t in timed:
                self._out.line(f"self._insert({t.index}, {t.delay}, NOTHING, 0, None)")
            self._content.blocks(self._out, blocks, None)
            for transition in defaults:
                with self._out.block(f"if defaults & {1 << transition.index:#x}:"):
                    self._tell(f"t {transition.index}")
                    self._content.block(self._out, transition.content, None)
            if state.kind is Kind.FINAL:
                self._final(state)

    def _timed(self, state: State) -> list[Transition]:
        found = [self._chart.transitions[index] for index in state.transitions]
        return [transition for transition in found if transition.trigger in TIMED]

    def _defaults(self, state: State) -> list[Transition]:
        """Return the initial transition and the defaults of the histories, those with content."""
        parts = [state, *(self._chart.states[c] for c in state.children)]
        numbers = [
            p.initial for p in parts if p.initial is not None and (p is state or p.is_history)
        ]
        found = [self._chart.transitions[number] for number in numbers]
        return [transition for transition in found if transition.content]

    def _final(self, state: State) -> None:
        parent = state.parent
        if parent is None or parent == 0:
            self._out.line("self._finish()")
            return
        self._done(parent, state)
        grandparent = self._chart.states[parent].parent
        if grandparent is not None and self._chart.states[grandparent].kind is Kind.PARALLEL:
            test = self._is_final(grandparent)
            if test is not None and self._event(grandparent) is not None:
                self._out.line("active = self._active")
                with self._out.block(f"if {test}:"):
                    self._done(grandparent, None)

    def _event(self, state: int) -> int | None:
        return self._chart.event_index.get(f"done.state.{self._chart.states[state].id}")

    def _done(self, state: int, final: State | None) -> None:
        """Raise ``done.state``, with the data of a final state (SCXML 5.5)."""
        event = self._event(state)
        if event is None:
            return
        self._content.done(self._out, event, final)

    def _is_final(self, state: int) -> str | None:
        """Return isInFinalState as text (Appendix D), None where it never is."""
        children = real_children(self._chart, state)
        match self._chart.states[state].kind:
            case Kind.COMPOUND:
                finals = [c for c in children if self._chart.states[c].kind is Kind.FINAL]
                return f"active & {mask(self._names, finals)}" if finals else None
            case Kind.PARALLEL:
                tests = [self._is_final(child) for child in children]
                if None in tests:
                    return None
                return " and ".join(filter(None, tests))
            case _:
                return None

    # --- transitions ------------------------------------------------------------------------

    def taken(self, transition: Transition) -> None:
        """Print what taking a transition does, in its three parts."""
        name, doc = self._names.transitions[transition.index], describe(self._chart, transition)
        if transition.targets:
            self._domain(transition)
            with self._out.method(f"_leave_{name}", f"{doc}: leave."):
                self._leave(transition)
        if transition.content:
            with self._out.method(f"_do_{name}", f"{doc}: content."):
                payload = payload_of(self._chart, transition)
                self._content.block(self._out, transition.content, payload)
        if transition.targets:
            with self._out.method(f"_enter_{name}", f"{doc}: enter."):
                self._enter_targets(transition)

    def _domain(self, transition: Transition) -> None:
        if not is_dynamic(self._chart, transition):
            return
        real = [t for t in transition.targets if not self._chart.states[t].is_history]
        name = self._names.transitions[transition.index]
        with self._out.method(
            f"_domain_{name}", "The domain, which a history decides.", result="int"
        ):
            self._out.line(f"targets = {mask(self._names, real)}")
            for target in transition.targets:
                if self._chart.states[target].is_history:
                    defaults = mask(self._names, effective_defaults(self._chart, target))
                    held = f"self._history_{self._names.states[target]}"
                    self._out.line(f"targets |= {held} or {defaults}")
            for domain in possible_domains(self._chart, transition):
                if domain == 0:
                    self._out.line("return 0")
                    continue
                below = mask(self._names, real_below(self._chart, domain))
                with self._out.block(f"if not targets & ~{below}:"):
                    self._out.line(f"return {domain}")

    def _leave(self, transition: Transition) -> None:
        domain = static_domain(self._chart, transition)
        if domain is not None:
            self._out.line(
                f"gone = self._active & {mask(self._names, real_below(self._chart, domain))}"
            )
            self._record(domain)
        else:
            name = self._names.transitions[transition.index]
            self._out.line(f"domain = self._domain_{name}()")
            word = "if"
            for domain in possible_domains(self._chart, transition):
                below = mask(self._names, real_below(self._chart, domain))
                with self._out.block(f"{word} domain == {domain}:"):
                    self._out.line(f"gone = self._active & {below}")
                    self._record(domain)
                word = "elif"
        self._out.line("self._exit(gone)")

    def _record(self, domain: int) -> None:
        """Record the histories of all states that are left, before any of them is (SCXML 3.10)."""
        for state in range(domain + 1, self._chart.states[domain].last_descendant + 1):
            histories = [
                c for c in self._chart.states[state].children if self._chart.states[c].is_history
            ]
            if not histories:
                continue
            with self._out.block(f"if gone & {self._names.states[state]}:"):
                for history in histories:
                    if self._chart.states[history].kind is Kind.SHALLOW_HISTORY:
                        kept = real_children(self._chart, state)
                    else:
                        below = real_below(self._chart, state)
                        kept = tuple(s for s in below if self._chart.states[s].is_leaf)
                    held = f"self._history_{self._names.states[history]}"
                    self._out.line(f"{held} = gone & {mask(self._names, kept)}")

    def _enter_targets(self, transition: Transition) -> None:
        domain = static_domain(self._chart, transition)
        if domain is not None:
            self._enter(entry_of(self._chart, transition.targets, domain))
            return
        name = self._names.transitions[transition.index]
        self._out.line(f"domain = self._domain_{name}()")
        word = "if"
        for domain in possible_domains(self._chart, transition):
            with self._out.block(f"{word} domain == {domain}:"):
                self._enter(entry_of(self._chart, transition.targets, domain))
            word = "elif"

    def _enter(self, decision: Decision) -> None:
        if isinstance(decision, Entry) and not decision.restored:
            states = mask(self._names, decision.states)
            self._out.line(f"self._enter({states}, {_bits(decision.defaults)})")
            return
        self._out.line("coming = defaults = 0")
        self._collect(decision)
        self._out.line("self._enter(coming, defaults)")

    def _collect(self, decision: Decision) -> None:
        """Print how the states to enter are put together."""
        match decision:
            case Recorded(history, then, otherwise):
                with self._out.block(f"if self._history_{self._names.states[history]}:"):
                    self._collect(then)
                with self._out.block("else:"):
                    self._collect(otherwise)
            case Entry(states, defaults, restored):
                if states:
                    self._out.line(f"coming |= {mask(self._names, states)}")
                if defaults:
                    self._out.line(f"defaults |= {_bits(defaults)}")
                for history in restored:
                    self._restore(history)

    def _restore(self, history: int) -> None:
        held = f"self._history_{self._names.states[history]}"
        parent = self._chart.states[history].parent
        assert parent is not None  # noqa: S101
        self._out.line(f"coming |= {held}")
        if self._chart.states[history].kind is Kind.DEEP_HISTORY:
            # what lies between the parent and the atomic states that were active
            for state in real_below(self._chart, parent):
                if below := real_below(self._chart, state):
                    with self._out.block(f"if {held} & {mask(self._names, below)}:"):
                        self._out.line(f"coming |= {self._names.states[state]}")
            return
        for child in real_children(self._chart, parent):
            if self._chart.states[child].children:
                with self._out.block(f"if {held} & {self._names.states[child]}:"):
                    self._collect(default_entry(self._chart, child))

    def clashes(self) -> None:
        """Print how conflicts are found where histories decide a domain."""
        related = {
            domain: sum(1 << t.index for t in self._static() if self._meets(t, domain))
            for domain in range(len(self._chart.states))
            if self._chart.states[domain].kind is Kind.COMPOUND or domain == 0
        }
        moving = [t for t in self._chart.transitions if is_dynamic(self._chart, t)]
        below = {d: sum(1 << o for o in related if _is_related(self._chart, d, o)) for d in related}
        with self._out.method(
            "_clashes",
            "Return the transitions whose exit sets meet that of this one.",
            "transition: int",
            "int",
        ):
            domains = {t.index: static_domain(self._chart, t) for t in self._static()}
            self._out.line(f"domain = {domains!r}.get(transition, -1)")
            for t in moving:
                with self._out.block(f"if transition == {t.index}:"):
                    self._out.line(f"domain = self._domain_{self._names.transitions[t.index]}()")
            with self._out.block("if domain < 0:"):
                self._out.line("return 0")
            self._out.line(f"found: int = {related!r}[domain]")
            self._out.line(f"related: int = {below!r}[domain]")
            for t in moving:
                name = self._names.transitions[t.index]
                with self._out.block(
                    f"if self._chosen & {1 << t.index:#x} and related >> self._domain_{name}() & 1:"
                ):
                    self._out.line(f"found |= {1 << t.index:#x}")
            self._out.line("return found")

    def _static(self) -> list[Transition]:
        return [
            t
            for t in self._chart.transitions
            if t.targets and t.trigger is not Trigger.INITIAL and not is_dynamic(self._chart, t)
        ]

    def _meets(self, transition: Transition, domain: int) -> bool:
        own = static_domain(self._chart, transition)
        return own is not None and _is_related(self._chart, own, domain)

    def _tell(self, line: str) -> None:
        with self._out.block("if self.trace is not None:"):
            self._out.line(f'self._tell("{line}")')


def _bits(numbers: frozenset[int]) -> str:
    return f"{sum(1 << n for n in numbers):#x}" if numbers else "0"
