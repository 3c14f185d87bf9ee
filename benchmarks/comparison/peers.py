"""The charts in packages of PyPI, built from the normative model; each is optional."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import version
from types import SimpleNamespace
from typing import Any

from benchmarks.comparison.folder import UnavailableError
from benchmarks.comparison.python_machines import Contender, Run
from benchmarks.comparison.streams import Stream

Do = Callable[..., Any]


class Work:
    """The variables of a chart, and its guards and contents as functions over them."""

    def __init__(self, chart: Any, variables: Sequence[str]) -> None:
        """Give all variables their start values; counters begin at 0."""
        self.names = variables
        self.data = SimpleNamespace(**{name: chart.vars.get(name, 0) for name in variables})

    def values(self) -> list[int]:
        """Return all variables in the order of the digest."""
        return [getattr(self.data, name) for name in self.names]

    def function(self, body: str) -> Do:
        """Return a function over the variables; what it is called with is ignored."""
        scope: dict[str, Any] = {"data": self.data}
        exec(f"def function(*ignored):\n    {body}", scope)  # noqa: S102  (text of the model)
        found: Do = scope["function"]
        return found

    def guard(self, text: str | None) -> Do | None:
        """Return a guard of the model as a function."""
        return None if text is None else self.function(f"return {self.own(text)}")

    def content(self, assignments: Sequence[tuple[str, str]]) -> Do | None:
        """Return the content of a transition as a function."""
        if not assignments:
            return None
        return self.function("; ".join(f"data.{name} = {self.own(x)}" for name, x in assignments))

    def count(self, state: Any, way: int) -> Do | None:
        """Return what an entry (0) or an exit (1) counts, as a function."""
        return self.function(f"data.{counter(state, way)} += 1") if state.act else None

    def own(self, text: str) -> str:
        """Return an expression over the attributes of ``data``."""
        return re.sub(r"\b[a-z]\w*\b", lambda name: f"data.{name[0]}", text)


def counter(state: Any, way: int) -> str:
    """Return the variable that counts the entries (0) or exits (1) of a state."""
    return f"c{2 * state.id + way}"


def tops(chart: Any) -> list[Any]:
    """Return the states that have no parent."""
    return [chart.states[name] for name in chart.order if not chart.states[name].parent]


def transitions_of(chart: Any) -> Iterator[tuple[Any, Any]]:
    """Yield each transition with its state; inner states follow outer ones."""
    for name in chart.order:
        for transition in chart.states[name].trans:
            yield chart.states[name], transition


def given(**values: Any) -> dict[str, Any]:
    """Return the arguments that are not None."""
    return {name: value for name, value in values.items() if value is not None}


def in_transitions(chart: Any, stream: Stream) -> Run:
    """Return the chart as a machine of ``transitions``: flat, or hierarchical where it must be."""
    is_flat = not any(at.ch for at in chart.states.values())
    machine_class = (
        import_module("transitions").Machine
        if is_flat
        else import_module("transitions.extensions").HierarchicalMachine
    )
    work = Work(chart, stream.variables)

    def path(name: str) -> str:
        return "_".join(reversed(chart.path(name)))

    def state(at: Any) -> dict[str, Any]:
        inner = [state(chart.states[name]) for name in at.ch]
        return {
            "name": at.name,
            **({("parallel" if at.kind == "parallel" else "children"): inner} if inner else {}),
            **given(initial=at.initial, on_enter=work.count(at, 0), on_exit=work.count(at, 1)),
        }

    model = SimpleNamespace()
    machine_class(
        model,
        states=[state(at) for at in tops(chart)],
        transitions=[
            {
                "trigger": t.ev,
                "source": path(at.name),
                "dest": t.target and path(default(chart, t.target)),
                **given(conditions=work.guard(t.cond), before=work.content(t.act)),
            }
            for at, t in transitions_of(chart)
        ],
        initial=path(chart.initial),
        auto_transitions=False,
        ignore_invalid_triggers=True,
    )
    start(chart, work)
    calls = [getattr(model, name) for name in stream.names]
    return Run(lambda events: [calls[event] for event in events], None, work.values)


def in_sismic(chart: Any, stream: Stream) -> Run:
    """Return the chart in an interpreter of ``sismic``, which evaluates its texts."""
    reader = import_module("sismic.io.datadict")
    interpreters = import_module("sismic.interpreter")

    def counts(at: Any, way: int) -> str | None:
        return f"{counter(at, way)} += 1" if at.act else None

    def state(at: Any) -> dict[str, Any]:
        inner = [state(chart.states[name]) for name in at.ch]
        leading = [
            given(
                event=t.ev,
                guard=t.cond,
                priority=-place,
                target=t.target and default(chart, t.target),
                action="\n".join(f"{name} = {text}" for name, text in t.act) or None,
            )
            for place, t in enumerate(at.trans)
        ]
        return {
            "name": at.name,
            **(
                {("parallel states" if at.kind == "parallel" else "states"): inner} if inner else {}
            ),
            **({"transitions": leading} if leading else {}),
            **given(initial=at.initial),
            **{
                key: text
                for key, text in {"on entry": counts(at, 0), "on exit": counts(at, 1)}.items()
                if text is not None
            },
        }

    root = {"name": "root", "initial": chart.initial, "states": [state(at) for at in tops(chart)]}
    preamble = "\n".join(f"{name} = {chart.vars.get(name, 0)}" for name in stream.variables)
    interpreter = interpreters.Interpreter(
        reader.import_from_dict(
            {"statechart": {"name": chart.name, "preamble": preamble, "root state": root}}
        )
    )
    interpreter.execute()

    def send(name: str) -> None:
        interpreter.queue(name).execute()

    def values() -> list[int]:
        return [interpreter.context[name] for name in stream.variables]

    return Run(lambda events: [stream.names[event] for event in events], send, values)


def in_statemachine(chart: Any, stream: Stream) -> Run:
    """Return the chart as a class of ``python-statemachine``."""
    factory = import_module("statemachine.io")
    work = Work(chart, stream.variables)

    def state(at: Any) -> dict[str, Any]:
        on: dict[str, list[dict[str, Any]]] = {}
        for t in at.trans:
            on.setdefault(t.ev, []).append(
                {
                    "target": t.target,
                    **given(cond=work.guard(t.cond), on=work.content(t.act)),
                }
            )
        is_first = at.name == (chart.states[at.parent].initial if at.parent else chart.initial)
        histories = [name for name, parent in chart.hist.items() if parent == at.name]
        return {
            "initial": is_first,
            "parallel": at.kind == "parallel",
            **given(enter=work.count(at, 0), exit=work.count(at, 1)),
            **({"on": on} if on else {}),
            **({"states": {name: state(chart.states[name]) for name in at.ch}} if at.ch else {}),
            **({"history": {name: {"type": "deep"} for name in histories}} if histories else {}),
        }

    machine_class = factory.create_machine_class_from_definition(
        chart.name, {at.name: state(at) for at in tops(chart)}
    )
    machine = machine_class()
    return Run(lambda events: [stream.names[event] for event in events], machine.send, work.values)


def in_pysm(chart: Any, stream: Stream) -> Run:
    """Return the chart as nested machines of ``pysm``."""
    pysm = import_module("pysm")
    work = Work(chart, stream.variables)
    top = pysm.StateMachine(chart.name)
    made: dict[str, Any] = {}

    def add(at: Any, parent: Any, *, is_initial: bool) -> None:
        made[at.name] = (pysm.StateMachine if at.ch else pysm.State)(at.name)
        made[at.name].handlers = given(enter=work.count(at, 0), exit=work.count(at, 1))
        parent.add_state(made[at.name], initial=is_initial)
        for name in at.ch:
            add(chart.states[name], made[at.name], is_initial=name == at.initial)

    for at in tops(chart):
        add(at, top, is_initial=at.name == chart.initial)
    for at, t in transitions_of(chart):
        made[at.name].parent.add_transition(
            made[at.name],
            made[t.target] if t.target else None,
            events=[t.ev],
            **given(
                condition=work.guard(t.cond) or work.function("return True"),
                action=work.content(t.act),
            ),
        )
    top.initialize()
    start(chart, work)
    event_class = pysm.Event

    def send(name: str) -> None:
        top.dispatch(event_class(name))

    return Run(lambda events: [stream.names[event] for event in events], send, work.values)


def default(chart: Any, target: str) -> str:
    """Return a target; the parent of a history, which these packages enter by default."""
    found: str = chart.hist.get(target, target)
    return found


def start(chart: Any, work: Work) -> None:
    """Count the entry of the initial state where a package enters it without a callback."""
    count = work.count(chart.states[chart.initial], 0)
    if count is not None:
        count()


@dataclass(frozen=True, slots=True)
class Peer:
    """A package of PyPI and how a chart is built with it."""

    package: str
    build: Callable[[Any, Stream], Run]
    charts: str = "ABC"
    has_history: bool = True


PEERS = (
    Peer("pysm", in_pysm, charts="AB"),
    Peer("transitions", in_transitions, has_history=False),
    Peer("sismic", in_sismic, has_history=False),
    Peer("python-statemachine", in_statemachine),
)


def contender(peer: Peer, chart: Any, stream: Stream) -> Contender:
    """Return a chart in a package; `UnavailableError` if it is missing or cannot express it."""
    try:
        name = f"{peer.package} {version(peer.package)}"
    except ImportError:
        raise UnavailableError(f"the package {peer.package} is not installed") from None
    if stream.letter not in peer.charts:
        raise UnavailableError(f"{peer.package} has no parallel states: no chart {stream.letter}")

    def start() -> Run:
        try:
            return peer.build(chart, stream)
        except Exception as error:
            raise UnavailableError(f"{name}: {type(error).__name__}: {error}") from error

    return Contender(name, peer.package, start, peer.has_history)
