"""The parts of a model put together, and what is asserted of that."""

from __future__ import annotations

from collections.abc import Sequence

from fsmkit.emit import Emitter
from fsmkit.export.cspm.alphabet import Alphabet
from fsmkit.export.cspm.assertions import Asserted
from fsmkit.export.cspm.frame import Frame
from fsmkit.export.cspm.identifiers import comment, listed, remark


class Whole:
    """Writes the end of a model. ``parts``: processes and their alphabets, sets to be joined."""

    def __init__(
        self,
        out: Emitter,
        alphabet: Alphabet,
        frame: Frame,
        asserted: Sequence[Asserted],
        parts: Sequence[tuple[str, list[str]]],
    ) -> None:
        """Take what the parts were written with."""
        self._out, self._all, self._frame = out, alphabet, frame
        self._asserted, self._parts = asserted, parts
        self._network = alphabet.network

    def write(self) -> None:
        """Write composition, visible names and assertions."""
        self._composition()
        self._visible_names()
        self._assertions()

    def _composition(self) -> None:
        out, n = self._out, self._frame.n
        remark(self._out, f"--- the system {'-' * 74}")
        out.line()
        for number, (_, alphabet) in enumerate(self._parts):
            out.line(f"{self._frame.alphabet}({number}) = Union({listed(alphabet, '  ')})")
        out.line()
        for number, (process, _) in enumerate(self._parts):
            out.line(f"{self._frame.part}({number}) = {process}")
        out.line()
        part = f"[{self._frame.alphabet}({n})] {self._frame.part}({n})"
        out.line(f"{self._frame.network} = (|| {n} : {{0..{len(self._parts) - 1}}} @ {part})")
        if any(one.is_carried for one in self._asserted):
            blocked = f"[| {{| {self._frame.violated} |}} |] STOP"
            out.line(f"{self._frame.system} = ({self._frame.network} {blocked})")
        else:
            out.line(f"{self._frame.system} = {self._frame.network}")
        out.line()

    def _visible_names(self) -> None:
        found, out = self._all, self._out
        machines = self._network.closed.system.machines
        hidden = [f"{{| {self._frame.start} |}}"]
        pairs = []
        for event, name in found.events.items():
            spelt, instance = found.spelt[event.machine], machines[event.machine]
            if instance.is_channel or instance.is_monitor:
                continue
            pairs.append(f"{name} <- {spelt.channel}.{found.labels[event.label]}")
        for machine, instance in enumerate(machines):
            if (instance.is_channel or instance.is_monitor) and found.own(machine):
                hidden.append(found.spelt[machine].steps)
        renamed = (
            f"({self._frame.system}{listed(pairs, '  ', '[[', ']]')})"
            if pairs
            else self._frame.system
        )
        out.line(f"{self._frame.visible} = ({renamed} \\ Union({listed(hidden, '  ')}))")
        out.line()

    def _assertions(self) -> None:
        out = self._out
        remark(self._out, f"--- what is asserted {'-' * 68}")
        out.line()
        internal = [name for event, name in self._all.events.items() if event.is_internal]
        remark(self._out, "What machines do by themselves while no time passes and nothing comes.")
        out.line(f"{self._frame.internal} = {listed(internal, '  ')}")
        if any(one.is_carried for one in self._asserted):
            remark(self._out, "The network with some violations let through.")
            e, all_ = self._frame.e, f"{{| {self._frame.violated} |}}"
            out.line(
                f"{self._frame.only}({e}) = ({self._frame.network} [| diff({all_}, {e}) |] STOP)"
            )
        out.line()
        remark(self._out, "No local state is needed that the explorer never saw.")
        self._never(self._frame.system, f"{{| {self._frame.unseen} |}}")
        for one in self._asserted:
            out.line()
            remark(self._out, f"{comment(one.of.name)}: {comment(one.of.text)}")
            if one.missing:
                remark(self._out, f"not carried over: {comment(one.missing)}")
            elif one.is_livelock:
                remark(self._out, "see the assertion of divergence below")
            else:
                event = f"{{| {self._frame.violated}.{one.name} |}}"
                self._never(f"{self._frame.only}({event})", event, wanted=one.wanted)
        out.line()
        remark(
            self._out,
            "Our `livelock_free`: the machines are not busy for ever while no time passes and\n"
            "nothing comes from outside.",
        )
        out.line(f"assert ({self._frame.system} \\ {self._frame.internal}) :[divergence free [FD]]")
        out.line()
        remark(
            self._out,
            "More than our `deadlock_free`: here it also fails where all machines rest or have\n"
            "ended, and nothing can come any more; and what may come from outside counts.",
        )
        if self._network.closed.unit:
            remark(
                self._out,
                "As `tock` goes on where all is quiet, it says that time is never stopped.",
            )
        out.line(f"assert {self._frame.system} :[deadlock free [F]]")

    def _never(self, process: str, events: str, *, wanted: bool = False) -> None:
        negation = "not " if wanted else ""
        self._out.line(f"assert {negation}STOP [T= ({process} \\ diff(Events, {events}))")
