"""Convert the steps and states of a simulated system to messages."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

from fsmkit.chart.chart import Chart, result_types
from fsmkit.chart.drawing.states.boxes import opening_folds
from fsmkit.diagnostics import FsmkitError
from fsmkit.inspector.charts import DrawnBy, chart_message
from fsmkit.inspector.commands import wrong
from fsmkit.inspector.simulation import Delivery, Moment, Simulation, SimulationStep
from fsmkit.runtime.interpreter.trace import value_text
from fsmkit.runtime.live.messages import AnyMessage, Named, Pass, Post, Set, State, to_json
from fsmkit.runtime.live.steps import hash_of, row_of_event, state_of, step_of
from fsmkit.runtime.live.values import from_json as value_from
from fsmkit.runtime.live.values import to_json as value_json
from fsmkit.system.machine import port_name

BY_HAND = "change"
"""Verb of a client's change of data; scripts do not have it."""


MOST_DRAWINGS = 100
"""Maximum number of stored drawings."""
_Key = tuple[str, bool, frozenset[str], frozenset[str]]


def _key(hash_: str, hide: Sequence[str], fold: Sequence[str], *, is_drawn: bool) -> _Key:
    return hash_, is_drawn, frozenset(hide), frozenset(fold)


class MessageEncoder:
    """Converts the results of a simulation to messages."""

    def __init__(self, simulation: Simulation) -> None:
        """Speak of the machines of a simulation."""
        self._charts, self._names = simulation.charts, simulation.names
        self.is_alone = simulation.system.is_open and len(simulation.names) == 1
        """Whether it is a chart alone, whose name no line of a script has."""
        self.hashes = tuple(map(hash_of, simulation.charts))
        self._texts: dict[_Key, bytes] = {}
        self.drawn: DrawnBy | None = None
        """Draws charts; None for a whole layout of each."""
        self.opening: Callable[[Chart], frozenset[int]] = opening_folds
        """Chooses the folded states of a drawing for which a client has not chosen them."""

    @property
    def machines(self) -> list[Named]:
        """The machines and the hashes of their charts."""
        pairs = zip(self._names, self.hashes, strict=True)
        return [Named(m=name, chart=hash_) for name, hash_ in pairs]

    def chart(
        self,
        hash_: str,
        hide: Sequence[str] = (),
        fold: Sequence[str] | None = None,
        *,
        is_drawn: bool = True,
    ) -> bytes:
        """Return the message of a chart, drawn once; `FsmkitError` for a hash of none.

        ``fold`` None: the states that are folded when the chart is first shown.
        """
        if hash_ not in self.hashes:
            raise wrong("this session has no chart of that hash", "use those of `hello`")
        fold = self._folds(hash_, fold)
        key = _key(hash_, hide, fold, is_drawn=is_drawn)
        if key not in self._texts:
            # each choice of folded states is another drawing; one that keeps positions starts from
            # the last, so that an earlier one is out of date
            most = MOST_DRAWINGS if self.drawn is None else 0
            while len(self._texts) > most:
                self._texts.pop(next(iter(self._texts)))
            chart = self._charts[self.hashes.index(hash_)]
            self._texts[key] = to_json(
                chart_message(chart, hide, fold, is_drawn=is_drawn, drawn=self.drawn)
            )
        return self._texts[key]

    def drawing(
        self,
        hash_: str,
        hide: Sequence[str] = (),
        fold: Sequence[str] | None = None,
        *,
        is_drawn: bool = True,
    ) -> Callable[[], object] | None:
        """Return a function that draws a chart in another thread, or None without a drawing."""
        if not is_drawn or hash_ not in self.hashes:
            return None
        fold = self._folds(hash_, fold)
        if _key(hash_, hide, fold, is_drawn=is_drawn) in self._texts:
            return None

        def draw() -> None:
            with suppress(FsmkitError):  # the command itself is rejected
                self.chart(hash_, hide, fold)

        return draw

    def _folds(self, hash_: str, fold: Sequence[str] | None) -> Sequence[str]:
        """Return the names of folded states: the given ones, or those of a first drawing."""
        if fold is not None:
            return fold
        chart = self._charts[self.hashes.index(hash_)]
        return [chart.states[state].id for state in sorted(self.opening(chart))]

    def states(self, n: int, moment: Moment) -> tuple[State, ...]:
        """Return all machines after an entry."""
        each = zip(self._charts, self._names, moment.snapshots, strict=True)
        return tuple(state_of(*one, moment.now) for one in ((c, m, n, s) for c, m, s in each))

    def unknown(self, n: int) -> tuple[State, ...]:
        """Return all machines, of which nothing is known."""
        return tuple(
            State(
                m=name, n=n, at=0, on=[], data={}, inputs={}, outputs={}, queue=[], deferred=[],
                timers=[], status="running", known=False,
            )
            for name in self._names
        )  # fmt: skip

    def step(self, n: int, moment: Moment, done: SimulationStep) -> list[AnyMessage]:
        """Return a step that led to a moment, then the events and inputs that it passed on."""
        charts, names = self._charts, self._names
        at = done.macrostep.at
        found: list[AnyMessage] = [
            step_of(charts[done.machine], names[done.machine], n, done.macrostep)
        ]
        found += [self._pass(n, each, at) for each in done.passed]
        inputs: dict[int, dict[str, Any]] = {}
        for each in done.driven:
            target = charts[each.machine]
            if each.number < len(target.inputs):
                declared = target.inputs[each.number]
                told = inputs.setdefault(each.machine, {})
                told[declared.name] = value_json(each.value, declared.type)
            else:  # shared data are not inputs: the whole machine is sent
                snapshot = moment.snapshots[each.machine]
                found.append(state_of(target, names[each.machine], n, snapshot, at))
        found += [Set(m=names[m], n=n, at=at, inputs=told) for m, told in inputs.items()]
        return found

    def _pass(self, n: int, passed: Delivery, at: int) -> Pass:
        link, names, charts = passed.link, self._names, self._charts
        event, *values = row_of_event(charts[link.target], passed.occurrence)
        return Pass(
            n=n,
            at=at,
            source=(names[link.source], port_name(charts[link.source], link.port)),
            target=(names[link.target], event),
            values=values,
            how="queued" if passed.has_room else "refused",
        )

    def action_line(self, message: AnyMessage) -> str | None:
        """Return a client's action as a script line, or None for any other message."""
        match message:
            case Post(m=name, event=[event, *values]):
                chart = self._charts[self._names.index(name)]
                fields = chart.events[chart.event_index[event]].fields
                typed = zip(values, fields, strict=True)
                words = [event, *(value_text(value_from(v, f.type)) for v, f in typed)]
                return f"post {self._place(name)}{' '.join(words)}"
            case Set(m=name, data=data) if data:
                return f"{BY_HAND} {name}.{' '.join(data)}"
            case Set(m=name, results=results) if results:
                result = result_types(self._charts[self._names.index(name)])
                return "\n".join(
                    " ".join((
                        f"returns {self._place(name)}{operation}",
                        *(value_text(value_from(value, result[operation])) for value in values),
                    ))
                    for operation, values in results.items()
                )  # fmt: skip
            case Set(m=name, inputs=inputs):
                chart = self._charts[self._names.index(name)]
                types = {each.name: each.type for each in chart.inputs}
                lines = (
                    f"input {self._place(name)}{key} {value_text(value_from(value, types[key]))}"
                    for key, value in inputs.items()
                )
                return "\n".join(lines)
            case _:
                return None

    def _place(self, machine: str) -> str:
        return "" if self.is_alone else f"{machine}."
