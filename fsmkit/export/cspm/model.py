"""Write a network of automata in CSPm.

A step of the explorer is one event of all parts involved, so the process has the same states and
steps, and one more state before the machines start.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from fsmkit.diagnostics import Findings
from fsmkit.emit import notating, telling
from fsmkit.export.collect import export_network
from fsmkit.export.cspm.alphabet import Alphabet
from fsmkit.export.cspm.assertions import Assertion, assertions_of
from fsmkit.export.cspm.events import Demand, OnMachine, OnQueue, after_values, received_values
from fsmkit.export.cspm.identifiers import Frame, Script, comment, format_names, offer
from fsmkit.export.exporter import ExportedModel, ExportOptions
from fsmkit.export.formula import Form
from fsmkit.export.network import Automaton, Local, Network
from fsmkit.system.system import System

HEADER = """\
{name}, for FDR and other tools of CSP; written by fsmkit. It belongs to whoever had it written.

{states} states and {transitions} steps{time}, one more state before the machines start.
A machine is a process, a local state of it an equation. A queue is a process that holds one of the
sequences that the explorer saw in it, so no process has more states than its part of the system.
A step of a machine is one event of all parts involved: `{system}` has the steps of the explorer.
`{visible}` is the same with readable names: `machine.event`; parts that only forward messages, or
watch, are hidden there.

Between events of a plant nothing else happens: a step of others needs the queues of the
environment, and of monitors, empty. An external event needs all queues empty but for one
event in one of them: there is an event for each queue that may hold it (a counter of what waits
would have to know which queues are full).
Local states and contents of queues that the explorer never saw are not here; `{unseen}` happens
where one is needed, and the first assertion states that this is nowhere.\
"""
TIMED = """\

Time passes by {unit} ticks in `tock`, in which all take part when none has anything left to do.
Where no timer is armed the explorer stops time; here `tock` changes nothing there. There is no
section `Timed`: it would give each event a duration, and here steps take no time.\
"""


def export(system: System, options: ExportOptions) -> ExportedModel:
    """Explore a system, then write its local steps."""
    return export_network(system, options, write_model)


@notating
def write_model(network: Network, findings: Findings | None = None) -> str:
    """Return the model."""
    return _Writer(network, findings).text()


QUEUE_WORDS = ("SEEN", "THEN", "UNSEEN")
"""The names in the process of a queue: its contents, the check of new ones, its dead end."""


class _Writer:
    """Writes the parts in their order."""

    def __init__(self, network: Network, findings: Findings | None) -> None:
        self._network = network
        self._all = Alphabet(network)
        self._frame = Frame(self._all.names)
        self._asserted = tuple(assertions_of(network, self._all.names, findings))
        self._parts: list[tuple[str, list[str]]] = []
        self._timed = network.closed.unit > 0
        self._out = Script()

    def text(self) -> str:
        self._header()
        self._declarations()
        for machine, automaton in enumerate(self._network.automata):
            self._machine(machine, automaton)
            if automaton.queue:
                self._queue(machine, automaton)
        self._composition()
        self._visible_names()
        self._assertions()
        return self._out.finish()

    # --- declarations ----------------------------------------------------------------------------

    def _header(self) -> None:
        frame, network = self._frame, self._network
        untimed = " (untimed: an armed timer fires at any time)" if network.closed.untimed else ""
        self._out.remark(
            HEADER.format(
                name=comment(network.name),
                system=frame.system,
                visible=frame.visible,
                unseen=frame.unseen,
                states=f"{network.states:,}",
                transitions=f"{network.transitions:,}",
                time=untimed,
            ),
        )
        if self._timed:
            self._out.remark(TIMED.format(unit=network.closed.unit))
        for sample in network.closed.samples:
            self._out.remark(f"Only some values are tried of {comment(sample)}.")
        self._out.line()

    def _declarations(self) -> None:
        out, frame, found = self._out, self._frame, self._all
        out.line(f"channel {frame.start} : {{0..{len(self._network.initial) - 1}}}")
        automata = self._network.automata
        count = len(automata) * (2 if any(automaton.queue for automaton in automata) else 1)
        out.line(f"channel {frame.unseen} : {{0..{count - 1}}}")
        if self._timed:
            out.line("channel tock")
        carried = [one for one in self._asserted if one.is_carried]
        if carried:
            out.line(f"datatype {frame.property} = {' | '.join(one.name for one in carried)}")
            most = max(len(one.cases) for one in carried)
            out.line(f"channel {frame.violated} : {frame.property}.{{0..{max(most, 1) - 1}}}")
        out.line()
        out.remark("The visible events, with readable names.")
        if any(".." in shown for shown in found.labels):
            out.remark(
                "A range such as 0..2 is one event for all its values that can occur: nothing"
            )
            out.remark("here distinguishes them.")
        if found.labels:
            out.line(f"datatype {frame.label} =")
            for number, (shown, name) in enumerate(found.labels.items()):
                out.line(f"  {'|' if number else ' '} {name}  -- {comment(shown)}")
        for machine, named in enumerate(found.machines):
            labels = dict.fromkeys(
                found.visible[machine, event.label]
                for event in found.events
                if event.machine == machine
            )
            if labels:
                out.line(f"channel {named.channel} : {format_names(list(labels), '  ')}")
        out.line()
        if any(automaton.queue for automaton in self._network.automata):
            out.remark("A sequence with one more message, if there is room for so many.")
            n, s, m = frame.n, frame.s, frame.m
            out.line(f"{frame.post}({n}, {s}, {m}) =")
            out.line(f"  if (length({s}) < {n}) then ({s}^<{m}>) else {s}")
            out.line()

    # --- machines --------------------------------------------------------------------------------

    def _machine(self, machine: int, automaton: Automaton) -> None:
        out, frame, found = self._out, self._frame, self._all
        named = found.machines[machine]
        out.title(automaton.name)
        for event, name in found.events.items():
            if event.machine == machine:
                out.line(f"channel {name}  -- {comment(found.about(event))}")
        own = found.own(machine)
        alphabet = [f"{{| {frame.start} |}}", f"{{{frame.unseen}.{machine}}}"]
        if own:
            out.line(f"{named.steps} = {format_names(own, '  ')}")
            alphabet.append(named.steps)
        if self._timed:
            alphabet.append("{tock}")
        received = self._received(machine, automaton)
        alphabet += received.values()
        alphabet += self._violations(machine, queue=False)
        self._parts.append((named.process, alphabet))
        out.line()
        first: dict[str, list[str]] = {}
        for number, places in enumerate(self._network.initial):
            name = named.locals[places[machine].local]
            first.setdefault(name, []).append(f"{frame.start}.{number}")
        out.equation(
            named.process,
            [self._offer(names, to) for to, names in first.items()],
        )
        moves: dict[int, dict[str, list[str]]] = {}
        for move, name in found.moves[machine]:
            own_values = received_values(self._network, move.sent, machine)
            after = after_values(automaton, move.target, own_values)
            to = named.unseen if after is None else named.locals[after]
            names = moves.setdefault(move.source, {}).setdefault(to, [])
            if name not in names:
                names.append(name)
        for number, local in enumerate(automaton.locals):
            if local.text != local.name:
                out.remark(comment(local.text))
            terms = [self._offer(names, to) for to, names in moves.get(number, {}).items()]
            terms += self._reactions(machine, number, received)
            if self._timed and not local.has_work:
                terms.append(self._offer(["tock"], self._later(machine, number, local)))
            terms += self._self_loops(machine, number)
            out.equation(named.locals[number], terms)
        out.equation(named.unseen, [f"({frame.unseen}.{machine} -> {named.unseen})"])
        out.line()

    def _offer(self, events: list[str], to: str) -> str:
        return offer(self._frame.e, events, to)

    def _of_sets(self, sets: list[str], to: str) -> str:
        joined = sets[0] if len(sets) == 1 else f"Union({format_names(sets, '      ')})"
        return f"([] {self._frame.e} : {joined} @ ({self._frame.e} -> {to}))"

    def _received(self, machine: int, automaton: Automaton) -> Mapping[OnMachine, str]:
        """Define the sets of events of others that are equivalent to a machine."""
        sets = {}
        upper = self._all.machines[machine].process
        for what, events in self._all.received[machine].items():
            texts = [automaton.arrivals[message].text for message in what.received]
            if what.demand is not Demand.ANY:
                texts.append(f"waiting for it: {what.demand.value}")
            self._out.remark(comment(", then ".join(texts)))
            sets[what] = self._all.names.take(f"{upper}_TOLD")
            self._out.line(f"{sets[what]} = {format_names(events, '  ')}")
        return sets

    def _reactions(
        self, machine: int, number: int, received: Mapping[OnMachine, str]
    ) -> Iterator[str]:
        automaton = self._network.automata[machine]
        named, waiting = self._all.machines[machine], automaton.locals[number].waiting
        found: dict[str, list[str]] = {}
        for what, name in received.items():
            if what.demand is Demand.EMPTY and waiting != 0:
                continue
            if what.demand is Demand.ONE and waiting != 1:
                continue
            after = after_values(automaton, number, what.received)
            to = named.unseen if after is None else named.locals[after]
            found.setdefault(to, []).append(name)
        for to, sets in found.items():
            yield self._of_sets(sets, to)

    def _later(self, machine: int, number: int, local: Local) -> str:
        """Return the state after a unit of time; without a timer of its own, the same."""
        after = self._network.automata[machine].elapsed.get(number)
        named = self._all.machines[machine]
        if after is None:
            return named.unseen if local.awaited else named.locals[number]
        return named.locals[after]

    # --- violations ------------------------------------------------------------------------------

    def _violations(self, machine: int, *, queue: bool) -> list[str]:
        """Return, as a set, the violations in which a machine, or its queue, takes part."""
        found = []
        for one in self._asserted:
            for number, case in enumerate(one.cases):
                part = machine in (case.empty if queue else dict(case.locals))
                if part:
                    found.append(self._event_of(one, number))
        return [format_names(found, "     ")] if found else []

    def _event_of(self, one: Assertion, number: int) -> str:
        return f"{self._frame.violated}.{one.name}.{number}"

    def _self_loops(self, machine: int, local: int) -> Iterator[str]:
        found = [
            self._event_of(one, number)
            for one in self._asserted
            for number, case in enumerate(one.cases)
            if local in dict(case.locals).get(machine, ())
        ]
        if found:
            yield self._offer(found, self._all.machines[machine].locals[local])

    # --- queues ----------------------------------------------------------------------------------

    def _queue(self, machine: int, automaton: Automaton) -> None:
        frame = self._frame
        out, found, s = self._out, self._all, frame.s
        named = found.machines[machine]
        out.remark(f"the queue of {comment(automaton.name)}: at most {automaton.queue} wait")
        messages = [
            named.messages[n] for n, arrival in enumerate(automaton.arrivals) if arrival.is_event
        ]
        type_ = found.names.take(f"{named.process}_MESSAGE")
        out.line(f"datatype {type_} = {format_names(messages, '  ', '', '').replace(',', ' |')}")
        seen, then, unseen = map(found.names.take, (f"{named.queue}_{w}" for w in QUEUE_WORDS))
        out.remark("what it holds at some time")
        contents = sorted(automaton.contents, key=lambda content: (len(content), content))
        words = [f"<{', '.join(named.messages[m] for m in content)}>" for content in contents]
        out.line(f"{seen} = {format_names(words, '  ')}")
        signal = f"{frame.unseen}.{len(self._network.automata) + machine}"
        out.line(f"{then}({s}) = if member({s}, {seen}) then {named.queue}({s}) else {unseen}")
        out.equation(unseen, [f"({signal} -> {unseen})"])
        sets = {}
        for what, events in found.queued[machine].items():
            sets[what] = found.names.take(named.queue)
            out.remark(self._about(automaton, what))
            out.line(f"{sets[what]} = {format_names(events, '  ')}")
        alphabet = [f"{{| {frame.start} |}}", f"{{{signal}}}", *sets.values()]
        if self._timed:
            alphabet.append("{tock}")
        violations = self._violations(machine, queue=True)
        alphabet += violations
        first: dict[str, list[str]] = {}
        for number, places in enumerate(self._network.initial):
            place = places[machine]
            waiting = ", ".join(named.messages[message] for message in place.queue)
            runs = automaton.locals[place.local].running
            to = f"{named.queue}(<{waiting}>)" if runs else named.closed
            first.setdefault(to, []).append(f"{frame.start}.{number}")
        begin = found.names.take(f"{named.queue}_START")
        self._parts.append((begin, alphabet))
        out.equation(begin, [self._offer(names, to) for to, names in first.items()])
        terms = [
            self._reaction(machine, automaton, what, name, then) for what, name in sets.items()
        ]
        if self._timed:
            terms.append(f"(null({s}) & (tock -> {named.queue}({s})))")
        if violations:
            again = f"{named.queue}({s})"
            loop = f"([] {frame.e} : {violations[0]} @ ({frame.e} -> {again}))"
            terms.append(f"(null({s}) & {loop})")
        out.equation(f"{named.queue}({s})", terms)
        closes = named.closed in first or any(what.closes for what in sets)
        if closes:
            out.remark("stopped: it discards all messages")
            allowed = [
                name
                for what, name in sets.items()
                if what.taken is None and what.demand in (Demand.ANY, Demand.EMPTY)
            ]
            allowed += ["{tock}"] if self._timed else []
            allowed += violations
            terms = [self._of_sets(allowed, named.closed)] if allowed else []
            out.equation(named.closed, terms)
        out.line()

    def _reaction(
        self, machine: int, automaton: Automaton, what: OnQueue, events: str, then: str
    ) -> str:
        """Return a term of a queue; ``then`` is the function for the next contents."""
        frame = self._frame
        named, s = self._all.machines[machine], frame.s
        rest = s if what.taken is None else f"tail({s})"
        for message in what.posted:
            rest = f"{frame.post}({automaton.queue}, {rest}, {named.messages[message]})"
        to = f"{named.queue}({s})" if rest == s else f"{then}({rest})"
        to = named.closed if what.closes else to
        term = f"([] {frame.e} : {events} @ ({frame.e} -> {to}))"
        if what.taken is not None:
            term = f"((head({s}) == {named.messages[what.taken]}) & {term})"
            return f"((not null({s})) & {term})"
        tests = {
            Demand.EMPTY: f"null({s})",
            Demand.ONE: f"(length({s}) == 1)",
            Demand.SOME: f"(not null({s}))",
        }
        return f"({tests[what.demand]} & {term})" if what.demand in tests else term

    @telling
    def _about(self, automaton: Automaton, what: OnQueue) -> str:
        texts = [f"must hold {what.demand.value}"] if what.demand is not Demand.ANY else []
        if what.taken is not None:
            texts.append(f"takes {automaton.arrivals[what.taken].text}")
        if what.posted:
            posted = (automaton.arrivals[message].text for message in what.posted)
            texts.append(f"gets {', '.join(posted)}")
        if what.closes:
            texts.append("is closed")
        return comment("; ".join(texts))

    # --- the whole -------------------------------------------------------------------------------

    def _composition(self) -> None:
        out, frame, n = self._out, self._frame, self._frame.n
        out.title("the system")
        for number, (_, alphabet) in enumerate(self._parts):
            out.line(f"{frame.alphabet}({number}) = Union({format_names(alphabet, '  ')})")
        out.line()
        for number, (process, _) in enumerate(self._parts):
            out.line(f"{frame.part}({number}) = {process}")
        out.line()
        part = f"[{frame.alphabet}({n})] {frame.part}({n})"
        out.line(f"{frame.network} = (|| {n} : {{0..{len(self._parts) - 1}}} @ {part})")
        if any(one.is_carried for one in self._asserted):
            blocked = f"[| {{| {frame.violated} |}} |] STOP"
            out.line(f"{frame.system} = ({frame.network} {blocked})")
        else:
            out.line(f"{frame.system} = {frame.network}")
        out.line()

    def _visible_names(self) -> None:
        frame = self._frame
        found, out = self._all, self._out
        machines = self._network.closed.system.machines
        hidden = [f"{{| {frame.start} |}}"]
        pairs = []
        for event, name in found.events.items():
            named, instance = found.machines[event.machine], machines[event.machine]
            if instance.is_channel or instance.is_monitor:
                continue
            pairs.append(f"{name} <- {named.channel}.{found.visible[event.machine, event.label]}")
        for machine, instance in enumerate(machines):
            if (instance.is_channel or instance.is_monitor) and found.own(machine):
                hidden.append(found.machines[machine].steps)
        renamed = (
            f"({frame.system}{format_names(pairs, '  ', '[[', ']]')})" if pairs else frame.system
        )
        out.line(f"{frame.visible} = ({renamed} \\ Union({format_names(hidden, '  ')}))")
        out.line()

    def _assertions(self) -> None:
        out, frame = self._out, self._frame
        out.title("what is asserted")
        internal = [name for event, name in self._all.events.items() if event.is_internal]
        out.remark("Internal steps, without time and without external events.")
        out.line(f"{frame.internal} = {format_names(internal, '  ')}")
        if any(one.is_carried for one in self._asserted):
            out.remark("The network with some violations let through.")
            e, all_ = frame.e, f"{{| {frame.violated} |}}"
            out.line(f"{frame.only}({e}) = ({frame.network} [| diff({all_}, {e}) |] STOP)")
        out.line()
        out.remark(
            "Nothing is needed that the explorer never saw: no local state, no content of a queue."
        )
        self._never(frame.system, f"{{| {frame.unseen} |}}")
        for one in self._asserted:
            out.line()
            out.remark(f"{comment(one.claim.property.name)}: {comment(one.claim.property.text)}")
            if one.claim.missing:
                out.remark(f"not carried over: {comment(one.claim.missing)}")
            elif one.claim.form is Form.LIVELOCK:
                out.remark("see the assertion of divergence below")
            else:
                event = f"{{| {frame.violated}.{one.name} |}}"
                self._never(
                    f"{frame.only}({event})", event, is_reached=one.claim.form is Form.REACHED
                )
        out.line()
        out.remark(
            "Our `livelock_free`: the machines are not busy for ever while no time passes and\n"
            "no external event occurs.",
        )
        out.line(f"assert ({frame.system} \\ {frame.internal}) :[divergence free [FD]]")
        out.line()
        if not self._timed:
            out.remark(
                "More than our `deadlock_free`: here it also fails where all machines rest or\n"
                "have ended, and no event can occur any more; possible external events count."
            )
            out.line(f"assert {frame.system} :[deadlock free [F]]")
            return
        out.remark(
            "Less than our `deadlock_free`: `tock` goes on where all machines rest or wait for\n"
            "ever, so it fails only where neither a machine, nor time, nor the environment moves.\n"
            "It holds where machines are busy for ever and `tock` never comes: see the next one."
        )
        out.line(f"assert {frame.system} :[deadlock free [F]]")
        out.line()
        out.remark(
            "Time can always advance: once the machines have done what takes no time, which ends,\n"
            "`tock` is possible."
        )
        out.line(f"{frame.time} = (CHAOS(diff(Events, {{tock}})) ||| RUN({{tock}}))")
        hidden = f"Union({{{frame.internal}, {{| {frame.start} |}}}})"
        out.line(f"assert {frame.time} [FD= ({frame.system} \\ {hidden})")

    def _never(self, process: str, events: str, *, is_reached: bool = False) -> None:
        negation = "not " if is_reached else ""
        self._out.line(f"assert {negation}STOP [T= ({process} \\ diff(Events, {events}))")
