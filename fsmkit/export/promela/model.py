"""Write a network of automata in Promela.

Each step of the explorer is one ``d_step`` of the process of the machine that moves (shared by
steps with the same effect, see `joint_moves`), so SPIN has the same states, and one more before the
start. A local state is a structure of its components. Names derived from machines end in ``_at``,
``_queue`` and the like, so that none is a reserved word.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping

from fsmkit.diagnostics import Findings
from fsmkit.emit import Emitter, notating
from fsmkit.emit.c import comment
from fsmkit.export.changes import Change, Joint, changes, joint_moves, shifting_components
from fsmkit.export.collect import export_network
from fsmkit.export.exporter import ExportedModel, ExportOptions
from fsmkit.export.formula import Claim, Form, claims
from fsmkit.export.identifiers import Names, word
from fsmkit.export.network import Automaton, Network, Place, Sent
from fsmkit.export.promela.words import is_reserved
from fsmkit.export.terms import Json, conjunction, equal, infix, negation
from fsmkit.export.vocabulary import Vocabulary
from fsmkit.system.properties.property import Property
from fsmkit.system.system import System

MACROS = (
    *("CALM", "FAULT", "FEW_WAIT", "MONITORS_WAIT", "NO_ROOM", "PLANT_WAITS", "QUEUES"),
    *("bad_", "begins_", "goal_"),
)
"""The prefixes of macros, which would be replaced in a field."""
OWN = ("_at", "_local", "_machine", "_queue")
"""How names end that are made from machines."""
FORMS = (Form.NEVER, Form.REACHED, Form.LEADS_TO)

HEADER = """\
/* {name}, for SPIN; written by fsmkit. It belongs to whoever had it written.
 *
 * {states} states and {transitions} steps{time}, one more state before the machines start.
 * A machine is a process, its local state a structure, its queue a channel. A step of a machine,
 * with all of its messages, is one d_step; states in which it has the same effect share it.
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


def export(system: System, options: ExportOptions) -> ExportedModel:
    """Explore a system, then write its local steps."""
    return export_network(system, options, write_model)


@notating
def write_model(network: Network, findings: Findings | None = None) -> str:
    """Return the model; ``findings`` report the omitted properties."""
    return _Writer(network).text(findings)


def claim_names(properties: Iterable[Property]) -> tuple[str, ...]:
    """Return for each property the name of its claim, by which SPIN selects it."""

    def claim(name: str) -> str:
        base = word(name)
        is_taken = is_reserved(base) or base == "started"
        is_taken = is_taken or base.startswith(MACROS) or base.endswith(OWN)
        return f"{base}_holds" if is_taken else base

    take = Names().take
    return tuple(take(claim(property_.name)) for property_ in properties)


class _Writer(Vocabulary):
    """Writes the parts in their order."""

    def __init__(self, network: Network) -> None:
        super().__init__(network)
        self._automata = network.automata
        self._out = Emitter()

    def field(self, name: str) -> str:
        base = word(name)
        return f"{base}_value" if is_reserved(base) or base.startswith(MACROS) else base

    def component(self, machine: int, component: int) -> str:
        return f"{self.machines[machine]}_at.{self.fields[machine][component]}"

    def queue(self, machine: int) -> str:
        """Return the channel."""
        return f"{self.machines[machine]}_queue"

    def is_empty(self, machine: int) -> Json:
        return equal(f"len({self.queue(machine)})", 0)

    def is_first(self, machine: int, message: int) -> Json:
        return f"{self.queue(machine)}?[{self.message(machine, message)}]"

    def counts(self, machine: int) -> Iterator[Json]:
        yield f"len({self.queue(machine)})"

    def _assigned(self, machine: int, change: Change) -> list[str]:
        return [f"{name} = {value}" for name, value in self.becomes(machine, change).items()]

    def _is_in(self, machine: int, locals_: Collection[int]) -> str:
        return infix(self.is_in(machine, locals_))

    def text(self, findings: Findings | None) -> str:
        out, network = self._out, self.network
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
        for name, rule in self.rules().items():
            out.line(f"#define {name.upper()} ({infix(rule)})")
        out.lines(["", "#ifdef QUEUES", "#define NO_ROOM assert(false)", "#else"])
        out.lines(["#define NO_ROOM skip", "#endif", "#ifdef FAULTS"])
        out.lines(["#define FAULT assert(false)", "#else", "#define FAULT skip", "#endif", ""])
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
        out, name = self._out, self.machines[machine]
        out.line(f"/* {comment(automaton.name)} */")
        for constant, number, note in self.constants(machine):
            out.line(f"#define {constant} {number}" + (f"  /* {comment(note)} */" if note else ""))
        if self.fields[machine]:
            with out.block(f"typedef {name}_local {{", "};"):
                for field, component in zip(
                    self.fields[machine], self.parts.components[machine], strict=True
                ):
                    out.line(f"unsigned {field} : {max(component.texts).bit_length()}")
            out.line(f"{name}_local {name}_at;")
        events = [n for n, arrival in enumerate(automaton.arrivals) if arrival.is_event]
        if automaton.queue and events:
            for number in events:
                note = comment(automaton.arrivals[number].text)
                out.line(f"#define {self.message(machine, number)} {number}  /* {note} */")
            type_ = _type(len(automaton.arrivals))
            out.line(f"chan {self.queue(machine)} = [{automaton.queue}] of {{ {type_} }};")
        out.line()

    # --- messages --------------------------------------------------------------------------------

    def _receiving(self, machine: int, automaton: Automaton) -> None:
        out, queue = self._out, self.queue(machine)
        if automaton.queue:
            stopped = self.is_in(machine, automaton.where(lambda local: not local.running))
            room = conjunction((negation(stopped), f"len({queue}) < {automaton.queue}"))
            with out.block(f"inline post_{self.machines[machine]}(message) {{", "}"):
                out.lines(["if", f":: {infix(stopped)}", f":: {infix(room)} -> {queue}!message"])
                out.lines([":: else -> NO_ROOM", "fi"])
        for number in range(len(automaton.arrivals)):
            maps = automaton.received(number)
            if not maps or _is_idle(maps):
                continue
            with out.block(f"inline {self.message(machine, number)}_() {{", "}"):
                out.line("if")
                full = {local for local, (_, is_full) in maps.items() if is_full}
                if full:
                    out.line(f":: {self._is_in(machine, full)} -> NO_ROOM")
                moved = {n: after for n, (after, is_full) in maps.items() if not is_full}
                self._changes(machine, moved)
                out.lines([":: else -> assert(false)", "fi"])
        out.line()

    def _changes(self, machine: int, maps: Mapping[int, int], but: Collection[int] = ()) -> None:
        """Write the effect on each local state, as options; ``but``: omitted components."""
        steps = list(maps.items())
        for change, places in changes(self.parts.codes[machine], steps, but=but):
            before = self._is_in(machine, {steps[place][0] for place in places})
            after = "; ".join(self._assigned(machine, change))
            self._out.line(f":: {before} -> {after}" if after else f":: {before}")

    def _sent(self, sent: Sent) -> str:
        automaton, message = self._automata[sent.target], self.message(sent.target, sent.message)
        if automaton.queues(sent.message):
            return f"post_{self.machines[sent.target]}({message})"
        return "" if _is_idle(automaton.received(sent.message)) else f"{message}_()"

    # --- processes -------------------------------------------------------------------------------

    def _start(self) -> None:
        out = self._out
        with out.block("init {", "}"):
            out.lines(["end:", "do"])
            for places in self.network.initial:
                texts = [t for n, place in enumerate(places) for t in self._placed(n, place)]
                out.line(f":: d_step {{ !started -> {'; '.join([*texts, 'started = true'])} }}")
            out.line("od")
        out.line()

    def _placed(self, machine: int, place: Place) -> Iterator[str]:
        yield from self._assigned(machine, dict(enumerate(self.parts.codes[machine][place.local])))
        for message in place.queue:
            yield f"{self.queue(machine)}!{self.message(machine, message)}"

    def _process(self, machine: int, automaton: Automaton) -> None:
        if not automaton.moves:
            return
        out = self._out
        with out.block(f"active proctype {self.machines[machine]}_machine() {{", "}"):
            out.lines(["end:", "do"])
            for option in joint_moves(automaton, self.parts.codes[machine]):
                out.line(f"/* {comment(_causes(option))} */")
                out.line(self._option(machine, automaton, option))
            out.line("od")
        out.line()

    def _option(self, machine: int, automaton: Automaton, option: Joint) -> str:
        move, queue = option.moves[0], self.queue(machine)
        guard = infix(conjunction(("started", self.guard(machine, option))))
        body = [] if move.taken is None else [f"{queue}?{self.message(machine, move.taken)}"]
        body += self._assigned(machine, option.change)
        body += ["FAULT"] if move.faults else []
        body += filter(None, map(self._sent, move.sent))
        if automaton.stops(move) and automaton.queue:
            body.append(f"do :: len({queue}) > 0 -> {queue}?_ :: else -> break od; skip")
        return f":: d_step {{ {guard} -> {'; '.join(body) or 'skip'} }}"

    def _clock(self) -> None:
        out = self._out
        with out.block("active proctype clock_() {", "}"):
            out.lines(["end:", "do"])
            guard = infix(conjunction(("started", self.time_passes())))
            out.line(f":: d_step {{ {guard} ->")
            for machine, automaton in enumerate(self._automata):
                if any(before != after for before, after in automaton.elapsed.items()):
                    with out.indented():
                        self._elapses(machine, automaton.elapsed)
            out.lines(["   skip }", "od"])
        out.line()

    def _elapses(self, machine: int, elapsed: Mapping[int, int]) -> None:
        """Write the changes by a unit of time.

        The remaining time of a timer is a function of itself; so are most components that change.
        The others come first, while these still have their old values.
        """
        out = self._out
        alone = shifting_components(self.parts.codes[machine], list(elapsed.items()))
        out.line("if")
        self._changes(machine, elapsed, but=alone)
        out.lines([":: else -> assert(false)", "fi;"])
        for component, shifts in alone.items():
            name = self.component(machine, component)
            out.line("if")
            for shift, numbers in shifts.items():
                there = infix(self.has(machine, component, numbers))
                out.line(f":: {there} -> {name} = {name} {shift:+}")
            out.lines([":: else", "fi;"])

    # --- properties ------------------------------------------------------------------------------

    def _properties(self, findings: Findings | None) -> None:
        network, out = self.network, self._out
        names = claim_names(network.closed.system.properties)
        found = claims(network, FORMS, findings, "formula of linear time")
        for name, claim in zip(names, found, strict=True):
            out.line(f"/* {comment(claim.property.name)}: {comment(claim.property.text)} */")
            if claim.missing:
                out.line(f"/* not carried over: {comment(claim.missing)} */")
            else:
                out.lines(self._claim(name, claim))
            out.line()

    def _claim(self, name: str, claim: Claim) -> Iterator[str]:
        """Yield the Buechi automaton of the negation: ``[] !bad`` or ``[] (starts -> <> goal)``."""
        condition = infix(conjunction(("started", self.formula(claim.condition))))
        if claim.form is not Form.LEADS_TO:
            if claim.form is Form.REACHED:
                yield "/* its violation is a path to it */"
            yield f"#define bad_{name} ({condition})"
            yield f"never {name} {{ do :: bad_{name} -> break :: else od }}"
            return
        yield "/* no fairness: in a violation an obligation may never be met */"
        yield f"#define begins_{name} ({condition})"
        yield f"#define goal_{name} ({infix(self.formula(claim.goal))})"
        yield f"never {name} {{"
        yield f"  do :: true :: begins_{name} && !goal_{name} -> break od;"
        yield f"accept: do :: !goal_{name} od"
        yield "}"


def _causes(option: Joint) -> str:
    """Return the causes of an option; if there are many, the first and the number of others."""
    labels = list(dict.fromkeys(move.label for move in option.moves))
    shown = ", ".join(labels[:NAMED])
    return f"{shown}, {len(labels) - NAMED} more" if len(labels) > NAMED else shown


def _is_idle(maps: Mapping[int, tuple[int, bool]]) -> bool:
    return all(before == after and not is_full for before, (after, is_full) in maps.items())


def _type(count: int) -> str:
    return "byte" if count <= 256 else "short" if count < 1 << 15 else "int"
