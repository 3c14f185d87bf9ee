"""A network of automata in CSPm.

A step of the explorer is one event of all parts that it concerns, so the process has the same
states and steps, and one more state before the machines start.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from fsmkit.diagnostics import Findings
from fsmkit.emit import Emitter
from fsmkit.export.cspm.alphabet import Alphabet
from fsmkit.export.cspm.assertions import Asserted, asserted
from fsmkit.export.cspm.events import Demand, OnMachine, OnQueue, after_told, told_values
from fsmkit.export.cspm.frame import Frame
from fsmkit.export.cspm.identifiers import comment, equation, listed, offer, remark
from fsmkit.export.cspm.whole import Whole
from fsmkit.export.network import Automaton, Local, Network
from fsmkit.texts import notating, telling

HEADER = """\
{name}, for FDR and other tools of CSP; written by fsmkit. It belongs to whoever had it written.

{states} states and {transitions} steps{time}, one more state before the machines start.
A machine is a process, a local state of it an equation; a queue is a process that holds a sequence.
A step of a machine is one event of all that it concerns: `{system}` has the steps of the explorer.
`{visible}` is the same as people name it: `machine.what_happens`; what only passes messages on, or
watches, is hidden there.

Between events of a plant nothing else happens: a step of others needs the queues of the
environment, and of monitors, empty. What comes from outside needs all queues empty but for one
event in one of them: there is an event for each queue that may hold it (a counter of what waits
would have to know which queues are full).
Local states that the explorer never saw are not here; `{unseen}` happens where one is needed.\
"""
TIMED = """\

Time passes by {unit} ticks in `tock`, in which all take part when none has anything left to do.
Where no timer is armed the explorer stops time; here `tock` changes nothing there. There is no
section `Timed`: it would give each event a duration, and here steps take no time.\
"""


@notating
def written(network: Network, findings: Findings | None = None) -> str:
    """Return the model."""
    return _Writer(network, findings).text()


class _Writer:
    """Writes the parts in their order."""

    def __init__(self, network: Network, findings: Findings | None) -> None:
        self._network = network
        self._all = Alphabet(network)
        self._frame = Frame(self._all.names)
        self._asserted = asserted(network, self._all.names, findings)
        self._parts: list[tuple[str, list[str]]] = []
        self._timed = network.closed.unit > 0
        self._out = Emitter("  ")

    def text(self) -> str:
        self._header()
        self._declarations()
        for machine, automaton in enumerate(self._network.automata):
            self._machine(machine, automaton)
            if automaton.queue:
                self._queue(machine, automaton)
        Whole(self._out, self._all, self._frame, self._asserted, self._parts).write()
        return self._out.finish()

    # --- declarations ----------------------------------------------------------------------------

    def _header(self) -> None:
        network = self._network
        untimed = " (untimed: an armed timer fires at any time)" if network.closed.untimed else ""
        remark(
            self._out,
            HEADER.format(
                name=comment(network.name),
                system=self._frame.system,
                visible=self._frame.visible,
                unseen=self._frame.unseen,
                states=f"{network.states:,}",
                transitions=f"{network.transitions:,}",
                time=untimed,
            ),
        )
        if self._timed:
            remark(self._out, TIMED.format(unit=network.closed.unit))
        for sample in network.closed.samples:
            remark(self._out, f"Only some values are tried of {comment(sample)}.")
        self._out.line()

    def _declarations(self) -> None:
        out, found = self._out, self._all
        out.line(f"channel {self._frame.start} : {{0..{len(self._network.initial) - 1}}}")
        out.line(f"channel {self._frame.unseen} : {{0..{len(self._network.automata) - 1}}}")
        if self._timed:
            out.line("channel tock")
        carried = [one for one in self._asserted if one.is_carried]
        if carried:
            out.line(f"datatype {self._frame.property} = {' | '.join(one.name for one in carried)}")
            most = max(len(one.cases) for one in carried)
            out.line(
                f"channel {self._frame.violated} : {self._frame.property}.{{0..{max(most, 1) - 1}}}"
            )
        out.line()
        remark(self._out, "What happens, as people name it.")
        if found.labels:
            out.line(f"datatype {self._frame.label} =")
            out.line(f"  {listed(list(found.labels.values()), '  ', '', '').replace(',', ' |')}")
        for machine, spelt in enumerate(found.spelt):
            labels = dict.fromkeys(
                found.labels[event.label] for event in found.events if event.machine == machine
            )
            if labels:
                out.line(f"channel {spelt.channel} : {listed(list(labels), '  ')}")
        out.line()
        if any(automaton.queue for automaton in self._network.automata):
            remark(self._out, "A sequence with one more message, if there is room for so many.")
            n, s, m = self._frame.n, self._frame.s, self._frame.m
            out.line(f"{self._frame.post}({n}, {s}, {m}) =")
            out.line(f"  if (length({s}) < {n}) then ({s}^<{m}>) else {s}")
            out.line()

    # --- machines --------------------------------------------------------------------------------

    def _machine(self, machine: int, automaton: Automaton) -> None:
        out, found = self._out, self._all
        spelt = found.spelt[machine]
        remark(self._out, f"--- {comment(automaton.name)} {'-' * (80 - len(automaton.name))}")
        out.line()
        for event, name in found.events.items():
            if event.machine == machine:
                out.line(f"channel {name}  -- {comment(found.about(event))}")
        own = found.own(machine)
        alphabet = [f"{{| {self._frame.start} |}}", f"{{{self._frame.unseen}.{machine}}}"]
        if own:
            out.line(f"{spelt.steps} = {listed(own, '  ')}")
            alphabet.append(spelt.steps)
        if self._timed:
            alphabet.append("{tock}")
        told = self._told(machine, automaton)
        alphabet += told.values()
        alphabet += self._violations(machine, queue=False)
        self._parts.append((spelt.process, alphabet))
        out.line()
        first: dict[str, list[str]] = {}
        for number, places in enumerate(self._network.initial):
            name = spelt.locals[places[machine].local]
            first.setdefault(name, []).append(f"{self._frame.start}.{number}")
        equation(
            self._out,
            spelt.process,
            [self._offer(names, to) for to, names in first.items()],
        )
        moves: dict[int, dict[str, list[str]]] = {}
        for move, name in found.moves[machine]:
            told_itself = told_values(self._network, move.sent, machine)
            after = after_told(automaton, move.target, told_itself)
            to = spelt.unseen if after is None else spelt.locals[after]
            names = moves.setdefault(move.source, {}).setdefault(to, [])
            if name not in names:
                names.append(name)
        for number, local in enumerate(automaton.locals):
            if local.text != local.name:
                remark(self._out, comment(local.text))
            terms = [self._offer(names, to) for to, names in moves.get(number, {}).items()]
            terms += self._hears(machine, number, told)
            if self._timed and not local.has_work:
                terms.append(self._offer(["tock"], self._later(machine, number, local)))
            terms += self._self_loops(machine, number)
            equation(self._out, spelt.locals[number], terms)
        equation(self._out, spelt.unseen, [f"({self._frame.unseen}.{machine} -> {spelt.unseen})"])
        out.line()

    def _offer(self, events: list[str], to: str) -> str:
        return offer(self._frame.e, events, to)

    def _of_sets(self, sets: list[str], to: str) -> str:
        joined = sets[0] if len(sets) == 1 else f"Union({listed(sets, '      ')})"
        return f"([] {self._frame.e} : {joined} @ ({self._frame.e} -> {to}))"

    def _told(self, machine: int, automaton: Automaton) -> Mapping[OnMachine, str]:
        """Define the sets of events of others that are the same to a machine."""
        sets = {}
        upper = self._all.spelt[machine].process
        for what, events in self._all.told[machine].items():
            texts = [automaton.arrivals[message].text for message in what.told]
            if what.demand is not Demand.ANY:
                texts.append(f"waiting for it: {what.demand.value}")
            remark(self._out, comment(", then ".join(texts)))
            sets[what] = self._all.names.new(f"{upper}_TOLD")
            self._out.line(f"{sets[what]} = {listed(events, '  ')}")
        return sets

    def _hears(self, machine: int, number: int, told: Mapping[OnMachine, str]) -> Iterator[str]:
        automaton = self._network.automata[machine]
        spelt, waiting = self._all.spelt[machine], automaton.locals[number].waiting
        found: dict[str, list[str]] = {}
        for what, name in told.items():
            if what.demand is Demand.EMPTY and waiting != 0:
                continue
            if what.demand is Demand.ONE and waiting != 1:
                continue
            after = after_told(automaton, number, what.told)
            to = spelt.unseen if after is None else spelt.locals[after]
            found.setdefault(to, []).append(name)
        for to, sets in found.items():
            yield self._of_sets(sets, to)

    def _later(self, machine: int, number: int, local: Local) -> str:
        """Return where a unit of time leads; without a timer of its own, nowhere else."""
        after = self._network.automata[machine].elapsed.get(number)
        spelt = self._all.spelt[machine]
        if after is None:
            return spelt.unseen if local.awaited else spelt.locals[number]
        return spelt.locals[after]

    # --- violations ------------------------------------------------------------------------------

    def _violations(self, machine: int, *, queue: bool) -> list[str]:
        """Return, as a set, the violations that a machine, or its queue, takes part in."""
        found = []
        for one in self._asserted:
            for number, case in enumerate(one.cases):
                part = machine in (case.empty if queue else dict(case.locals))
                if part:
                    found.append(self._event_of(one, number))
        return [listed(found, "     ")] if found else []

    def _event_of(self, one: Asserted, number: int) -> str:
        return f"{self._frame.violated}.{one.name}.{number}"

    def _self_loops(self, machine: int, local: int) -> Iterator[str]:
        found = [
            self._event_of(one, number)
            for one in self._asserted
            for number, case in enumerate(one.cases)
            if local in dict(case.locals).get(machine, ())
        ]
        if found:
            yield self._offer(found, self._all.spelt[machine].locals[local])

    # --- queues ----------------------------------------------------------------------------------

    def _queue(self, machine: int, automaton: Automaton) -> None:
        out, found, s = self._out, self._all, self._frame.s
        spelt = found.spelt[machine]
        remark(self._out, f"the queue of {comment(automaton.name)}: at most {automaton.queue} wait")
        messages = [
            spelt.messages[n] for n, arrival in enumerate(automaton.arrivals) if arrival.is_event
        ]
        type_ = found.names.new(f"{spelt.process}_MESSAGE")
        out.line(f"datatype {type_} = {listed(messages, '  ', '', '').replace(',', ' |')}")
        sets = {}
        for what, events in found.queued[machine].items():
            sets[what] = found.names.new(spelt.queue)
            remark(self._out, self._about(automaton, what))
            out.line(f"{sets[what]} = {listed(events, '  ')}")
        alphabet = [f"{{| {self._frame.start} |}}", *sets.values()]
        if self._timed:
            alphabet.append("{tock}")
        violations = self._violations(machine, queue=True)
        alphabet += violations
        first: dict[str, list[str]] = {}
        for number, places in enumerate(self._network.initial):
            place = places[machine]
            waiting = ", ".join(spelt.messages[message] for message in place.queue)
            runs = automaton.locals[place.local].running
            to = f"{spelt.queue}(<{waiting}>)" if runs else spelt.closed
            first.setdefault(to, []).append(f"{self._frame.start}.{number}")
        begin = found.names.new(f"{spelt.queue}_START")
        self._parts.append((begin, alphabet))
        equation(self._out, begin, [self._offer(names, to) for to, names in first.items()])
        terms = [self._reaction(machine, automaton, what, name) for what, name in sets.items()]
        if self._timed:
            terms.append(f"(null({s}) & (tock -> {spelt.queue}({s})))")
        if violations:
            again = f"{spelt.queue}({s})"
            loop = f"([] {self._frame.e} : {violations[0]} @ ({self._frame.e} -> {again}))"
            terms.append(f"(null({s}) & {loop})")
        equation(self._out, f"{spelt.queue}({s})", terms)
        closes = spelt.closed in first or any(what.closes for what in sets)
        if closes:
            remark(self._out, "stopped: it swallows what comes")
            allowed = [
                name
                for what, name in sets.items()
                if what.taken is None and what.demand in (Demand.ANY, Demand.EMPTY)
            ]
            allowed += ["{tock}"] if self._timed else []
            allowed += violations
            terms = [self._of_sets(allowed, spelt.closed)] if allowed else []
            equation(self._out, spelt.closed, terms)
        out.line()

    def _reaction(self, machine: int, automaton: Automaton, what: OnQueue, events: str) -> str:
        spelt, s = self._all.spelt[machine], self._frame.s
        rest = s if what.taken is None else f"tail({s})"
        for message in what.posted:
            rest = f"{self._frame.post}({automaton.queue}, {rest}, {spelt.messages[message]})"
        to = spelt.closed if what.closes else f"{spelt.queue}({rest})"
        term = f"([] {self._frame.e} : {events} @ ({self._frame.e} -> {to}))"
        if what.taken is not None:
            term = f"((head({s}) == {spelt.messages[what.taken]}) & {term})"
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
