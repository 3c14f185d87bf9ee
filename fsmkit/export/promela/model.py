"""A network of automata in Promela.

Each step of the explorer is one ``d_step`` of the process of the machine that moves (shared by
steps that do the same, see `options`), so SPIN has the same states, and one more before the start.
A local state is a structure of its components.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.emit import Emitter
from fsmkit.export.changes import Change, Joint, by_themselves, changes
from fsmkit.export.exporter import leave_out
from fsmkit.export.formula import condition_of, deadlock, goal_of
from fsmkit.export.network import Automaton, Move, Network, Place, Sent
from fsmkit.export.promela.identifiers import Spelling, claims
from fsmkit.export.promela.options import options
from fsmkit.system.properties.property import AtStates, Builtin, OverGraph, Property
from fsmkit.texts import notating
from fsmkit.texts.c import comment
from fsmkit.verify.statespace.actions import Action
from fsmkit.verify.statespace.closed_system import MAX_PENDING_BEFORE_INPUT

HEADER = """\
/* {name}, for SPIN; written by fsmkit. It belongs to whoever had it written.
 *
 * {states} states and {transitions} steps{time}, one more state before the machines start.
 * A machine is a process, its local state a structure, its queue a channel. A step of a machine,
 * with all that it tells others, is one d_step; states from which it does the same share it.
 * Local states that the explorer never saw are not here; an assertion fails where one were needed.
 *
 *   spin -a FILE
 *   cc -O2 -DNOREDUCE -DNOCLAIM -o pan pan.c && ./pan -n        all states
 *   cc -O2 -DNOREDUCE -o pan pan.c && ./pan -a -N NAME          a property
 *
 * With -DQUEUES (to spin) a message that finds its queue full is an error, with -DFAULTS a fault.
 */"""


NAMED = 3
"""So many causes are named in a comment."""


@notating
def written(network: Network, findings: Findings | None = None) -> str:
    """Return the model; ``findings`` report the properties that are left out."""
    return _Writer(network).text(findings)


class _Writer:
    """Writes the parts in their order."""

    def __init__(self, network: Network) -> None:
        self._network = network
        self._spelling = Spelling(network)
        self._automata = network.automata
        self._out = Emitter()

    def text(self, findings: Findings | None) -> str:
        out, network = self._out, self._network
        timed = ""
        if network.closed.unit:
            timed = f" (time passes by {network.closed.unit} ticks)"
        elif network.closed.untimed:
            timed = " (untimed: an armed timer fires at any time)"
        shown = HEADER.format(
            name=comment(network.name),
            states=f"{network.states:,}",
            transitions=f"{network.transitions:,}",
            time=timed,
        )
        out.lines(shown.splitlines())
        for sample in network.closed.samples:
            out.line(f"/* Only some values are tried of {comment(sample)}. */")
        out.line()
        for machine, automaton in enumerate(self._automata):
            self._declarations(machine, automaton)
        out.line("bool started;")
        out.line()
        self._rules()
        for machine, automaton in enumerate(self._automata):
            self._receiving(machine, automaton)
        self._start()
        for machine, automaton in enumerate(self._automata):
            self._process(machine, automaton)
        if network.closed.unit:
            self._clock()
        self._properties(findings)
        return out.finish()

    # --- declarations ----------------------------------------------------------------------------

    def _declarations(self, machine: int, automaton: Automaton) -> None:
        out, spelling = self._out, self._spelling
        out.line(f"/* {comment(automaton.name)} */")
        components = spelling.parts.components[machine]
        for part, component in enumerate(components):
            for number in () if component.plain else component.texts:
                note = comment(component.note(number))
                name = spelling.value(machine, part, number)
                out.line(f"#define {name} {number}" + (f"  /* {note} */" if note else ""))
        if components:
            with out.block(f"typedef {spelling.machines[machine]}_local {{", "};"):
                for part, component in enumerate(components):
                    bits = max(component.texts).bit_length()
                    out.line(f"unsigned {spelling.field(machine, part)} : {bits}")
            out.line(f"{spelling.machines[machine]}_local {spelling.at(machine)};")
        events = [n for n, arrival in enumerate(automaton.arrivals) if arrival.is_event]
        if automaton.queue and events:
            for number in events:
                note = comment(automaton.arrivals[number].text)
                out.line(f"#define {spelling.message(machine, number)} {number}  /* {note} */")
            type_ = _type(len(automaton.arrivals))
            out.line(f"chan {spelling.queue(machine)} = [{automaton.queue}] of {{ {type_} }};")
        out.line()

    def _waits(self, machine: int) -> str:
        if self._automata[machine].queue:
            return f"len({self._spelling.queue(machine)}) > 0"
        inner = self._automata[machine].where(lambda local: local.waiting > 0)
        return self._spelling.is_in(machine, inner)

    def _rules(self) -> None:
        """Define who may move: monitors see everything first, then the environment answers."""
        out = self._out
        network = self._network
        for name, machines in (("MONITORS_WAIT", network.monitors), ("PLANT_WAITS", network.plant)):
            found = [text for text in map(self._waits, machines) if text != "false"]
            out.line(f"#define {name} ({' || '.join(found) or 'false'})")
        out.line("#define CALM (started && !MONITORS_WAIT && !PLANT_WAITS)")
        counts = [
            f"len({self._spelling.queue(m)})"
            for m in range(len(self._automata))
            if self._automata[m].queue
        ]
        for machine, automaton in enumerate(self._automata):
            for waiting, of in automaton.waiting():
                counts.append(f"{waiting} * {self._spelling.is_in(machine, of)}")
        out.line(f"#define FEW_WAIT ({' + '.join(counts) or '0'} <= {MAX_PENDING_BEFORE_INPUT})")
        out.lines(["", "#ifdef QUEUES", "#define NO_ROOM assert(false)", "#else"])
        out.lines(["#define NO_ROOM skip", "#endif", "#ifdef FAULTS"])
        out.lines(["#define FAULT assert(false)", "#else", "#define FAULT skip", "#endif", ""])

    # --- messages --------------------------------------------------------------------------------

    def _receiving(self, machine: int, automaton: Automaton) -> None:
        out, spelling = self._out, self._spelling
        queue = spelling.queue(machine)
        if automaton.queue:
            stopped = automaton.where(lambda local: not local.running)
            with out.block(f"inline post_{spelling.machines[machine]}(message) {{", "}"):
                out.line("if")
                if stopped:
                    out.line(f":: {spelling.is_in(machine, stopped)}")
                runs = f"!{spelling.is_in(machine, stopped)} && " if stopped else ""
                out.line(f":: {runs}len({queue}) < {automaton.queue} -> {queue}!message")
                out.lines([":: else -> NO_ROOM", "fi"])
        for number in range(len(automaton.arrivals)):
            maps = automaton.received(number)
            if not maps or _is_idle(maps):
                continue
            with out.block(f"inline {spelling.message(machine, number)}_() {{", "}"):
                out.line("if")
                full = {local for local, (_, is_full) in maps.items() if is_full}
                if full:
                    out.line(f":: {spelling.is_in(machine, full)} -> NO_ROOM")
                moved = [(n, after) for n, (after, is_full) in maps.items() if not is_full]
                for change, places in changes(spelling.parts.codes[machine], moved):
                    befores = {moved[place][0] for place in places}
                    out.line(f":: {self._changes(machine, befores, change)}")
                out.lines([":: else -> assert(false)", "fi"])
        out.line()

    def _changes(self, machine: int, befores: Collection[int], change: Change) -> str:
        """Return a test of local states, and what changes there."""
        made = "; ".join(self._spelling.becomes(machine, change))
        return self._spelling.is_in(machine, befores) + (f" -> {made}" if made else "")

    def _tell(self, sent: Sent) -> str:
        automaton, spelling = self._automata[sent.target], self._spelling
        message = spelling.message(sent.target, sent.message)
        if automaton.queues(sent.message):
            return f"post_{spelling.machines[sent.target]}({message})"
        return "" if _is_idle(automaton.received(sent.message)) else f"{message}_()"

    # --- processes -------------------------------------------------------------------------------

    def _start(self) -> None:
        out = self._out
        with out.block("init {", "}"):
            out.lines(["end:", "do"])
            for places in self._network.initial:
                texts = ["!started ->"]
                for machine, place in enumerate(places):
                    texts += self._placed(machine, place)
                out.line(f":: d_step {{ {texts[0]} {'; '.join([*texts[1:], 'started = true'])} }}")
            out.line("od")
        out.line()

    def _placed(self, machine: int, place: Place) -> Iterator[str]:
        spelling = self._spelling
        yield from spelling.becomes(
            machine, dict(enumerate(spelling.parts.codes[machine][place.local]))
        )
        for message in place.queue:
            yield f"{spelling.queue(machine)}!{spelling.message(machine, message)}"

    def _process(self, machine: int, automaton: Automaton) -> None:
        if not automaton.moves:
            return
        out, spelling = self._out, self._spelling
        with out.block(f"active proctype {spelling.machines[machine]}_machine() {{", "}"):
            out.lines(["end:", "do"])
            for option in options(spelling, machine):
                out.line(f"/* {comment(_told(option))} */")
                out.line(self._option(machine, automaton, option))
            out.line("od")
        out.line()

    def _option(self, machine: int, automaton: Automaton, option: Joint) -> str:
        spelling, move = self._spelling, option.moves[0]
        queue = spelling.queue(machine)
        guard = [
            spelling.is_in(machine, option.sources),
            self._turn(machine, automaton, move),
        ]
        body = []
        if move.taken is not None:
            message = spelling.message(machine, move.taken)
            guard.append(f"{queue}?[{message}]")
            body.append(f"{queue}?{message}")
        elif move.needs_empty and automaton.queue:
            guard.append(f"len({queue}) == 0")
        if move.from_outside:
            guard.append("FEW_WAIT")
        body += spelling.becomes(machine, option.change)
        if move.faults:
            body.append("FAULT")
        body += [text for text in map(self._tell, move.sent) if text]
        if automaton.stops(move) and automaton.queue:
            body.append(f"do :: len({queue}) > 0 -> {queue}?_ :: else -> break od; skip")
        return f":: d_step {{ {' && '.join(guard)} -> {'; '.join(body) or 'skip'} }}"

    def _turn(self, machine: int, automaton: Automaton, move: Move) -> str:
        """Return whether the machine may move (see `_rules`)."""
        takes = move.action is Action.TAKE
        waits = self._waits(machine)
        if automaton.is_monitor and waits != "false":
            return "started" if takes else f"(CALM || (started && {waits}))"
        if automaton.is_environment and waits != "false":
            answers = "started && !MONITORS_WAIT"
            if takes:
                return answers
            if move.action is Action.EVENTLESS:
                return f"(CALM || ({answers} && {waits}))"
        return "CALM"

    def _clock(self) -> None:
        """Time passes where nothing is left to do and a timer is armed."""
        out, spelling = self._out, self._spelling
        awaited, still = [], []
        for machine, automaton in enumerate(self._automata):
            armed = automaton.where(lambda local: local.awaited)
            idle = automaton.where(lambda local: not local.has_work)
            if armed:
                awaited.append(spelling.is_in(machine, armed))
            if automaton.queue:
                still.append(f"len({spelling.queue(machine)}) == 0")
            still.append(spelling.is_in(machine, idle))
        guard = [
            f"({' || '.join(awaited) or 'false'})",
            *(text for text in still if text != "true"),
        ]
        with out.block("active proctype clock_() {", "}"):
            out.lines(["end:", "do"])
            out.line(f":: d_step {{ started && {' && '.join(guard)} ->")
            for machine, automaton in enumerate(self._automata):
                if any(before != after for before, after in automaton.elapsed.items()):
                    out.lines(f"   {line}" for line in self._elapses(machine, automaton.elapsed))
            out.lines(["   skip }", "od"])
        out.line()

    def _elapses(self, machine: int, elapsed: Mapping[int, int]) -> Iterator[str]:
        """Yield what a unit of time changes.

        The time that a timer has left is a function of itself; so are most components that change.
        The others come first, while these still are what they were.
        """
        spelling = self._spelling
        codes, steps = spelling.parts.codes[machine], list(elapsed.items())
        alone = by_themselves(codes, steps)
        yield "if"
        for change, places in changes(codes, steps, but=alone):
            befores = {steps[place][0] for place in places}
            yield f":: {self._changes(machine, befores, change)}"
        yield from (":: else -> assert(false)", "fi;")
        for component, shifts in alone.items():
            name = spelling.component(machine, component)
            yield "if"
            for shift, numbers in shifts.items():
                yield f":: {spelling.has(machine, component, numbers)} -> {name} = {name} {shift:+}"
            yield from (":: else", "fi;")

    # --- properties ------------------------------------------------------------------------------

    def _properties(self, findings: Findings | None) -> None:
        network, out = self._network, self._out
        properties = network.closed.system.properties
        for name, property_ in zip(claims(properties), properties, strict=True):
            out.line(f"/* {comment(property_.name)}: {comment(property_.text)} */")
            try:
                claim = list(self._property(name, property_))
                why = "" if claim else f"`{property_.kind.key}` is no formula of linear time"
            except FsmkitError as error:
                claim, why = [], error.diagnostics[0].message
            if why:
                leave_out(property_, why, findings)
                claim = [f"/* not carried over: {comment(why)} */"]
            out.lines(claim)
            out.line()

    def _property(self, name: str, property_: Property) -> Iterator[str]:
        """Yield the claim of a property; nothing where it is no formula of linear time."""
        network, spelling = self._network, self._spelling
        match property_.kind.decided:
            case Builtin.DEADLOCK:
                yield from _never(name, spelling.formula(deadlock(network)))
            case AtStates(negated=is_negated, wanted=is_wanted):
                marked = spelling.formula(condition_of(network, property_))
                if is_wanted:
                    yield "/* its violation is the way there */"
                yield from _never(name, f"!{marked}" if is_negated else marked)
            case OverGraph(procedure="leads-to"):
                begins = spelling.formula(condition_of(network, property_))
                goal = spelling.formula(goal_of(network, property_))
                yield "/* no fairness: in a violation something that is owed may never come */"
                yield from _never_comes(name, begins, goal)


def _never(name: str, bad: str) -> Iterator[str]:
    """Yield the claim for ``[] !bad``: it ends where that is violated."""
    yield f"#define bad_{name} (started && {bad})"
    yield f"never {name} {{ do :: bad_{name} -> break :: else od }}"


def _never_comes(name: str, begins: str, goal: str) -> Iterator[str]:
    """Yield the claim for ``[] (begins -> <> goal)``, a Buechi automaton of its negation."""
    yield f"#define begins_{name} (started && {begins})"
    yield f"#define goal_{name} {goal}"
    yield f"never {name} {{"
    yield f"  do :: true :: begins_{name} && !goal_{name} -> break od;"
    yield f"accept: do :: !goal_{name} od"
    yield "}"


def _told(option: Joint) -> str:
    """Return by what an option is taken; of many causes, the first and how many more."""
    labels = list(dict.fromkeys(move.label for move in option.moves))
    shown = ", ".join(labels[:NAMED])
    return f"{shown}, {len(labels) - NAMED} more" if len(labels) > NAMED else shown


def _is_idle(maps: Mapping[int, tuple[int, bool]]) -> bool:
    return all(before == after and not is_full for before, (after, is_full) in maps.items())


def _type(count: int) -> str:
    return "byte" if count <= 256 else "short" if count < 1 << 15 else "int"
