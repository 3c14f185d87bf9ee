"""The charts of the yardstick in packages of PyPI; each package is optional."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import version
from types import SimpleNamespace
from typing import Any

from benchmarks.comparison.python_machines import Contender, Run
from benchmarks.comparison.tools import UnavailableError
from benchmarks.yardstick.charts import Chart, Content, State, Transition
from benchmarks.yardstick.model import Work
from benchmarks.yardstick.streams import Stream


def start(chart: Chart, work: Work) -> None:
    """Count the entry of the initial state where a package enters it without a callback."""
    content = work.content(chart.states[chart.initial].entry)
    if content is not None:
        content()


def transitions_of(chart: Chart) -> Iterator[Transition]:
    """Yield the transitions; those of inner states follow those of outer ones."""
    for state in chart.states.values():
        yield from state.transitions


def default(chart: Chart, target: str) -> str:
    """Return a target; for a history, its parent, which these packages enter by default."""
    history = chart.histories.get(target)
    return history.parent if history else target


def given(**values: Any) -> dict[str, Any]:
    """Return the arguments that are not None."""
    return {name: value for name, value in values.items() if value is not None}


def in_transitions(stream: Stream) -> Run:
    """Return the chart as a machine of ``transitions``: flat, or hierarchical where it must be."""
    chart, work = stream.chart, Work(stream.chart)
    is_flat = not any(state.children for state in chart.states.values())
    machine_class = (
        import_module("transitions").Machine
        if is_flat
        else import_module("transitions.extensions").HierarchicalMachine
    )

    def path(name: str) -> str:
        return "_".join(reversed(chart.path(name)))

    def definition(state: State) -> dict[str, Any]:
        inner = [definition(chart.states[name]) for name in state.children]
        entry, exit_ = work.content(state.entry), work.content(state.exit)
        return {
            "name": state.name,
            **({("parallel" if state.is_parallel else "children"): inner} if inner else {}),
            **given(initial=state.initial, on_enter=entry, on_exit=exit_),
        }

    model = SimpleNamespace()
    machine_class(
        model,
        states=[definition(state) for state in chart.roots()],
        transitions=[
            {
                "trigger": t.event,
                "source": path(t.source),
                "dest": t.target and path(default(chart, t.target)),
                **given(conditions=work.guard(t.guard), before=work.content(t.content)),
            }
            for t in transitions_of(chart)
        ],
        initial=path(chart.initial),
        auto_transitions=False,
        ignore_invalid_triggers=True,
    )
    start(chart, work)
    calls = [getattr(model, name) for name in stream.names]
    return Run(lambda events: [calls[event] for event in events], None, work.values)


def in_sismic(stream: Stream) -> Run:
    """Return the chart in an interpreter of ``sismic``, which evaluates its texts."""
    reader = import_module("sismic.io.datadict")
    interpreters = import_module("sismic.interpreter")

    chart = stream.chart

    def definition(state: State) -> dict[str, Any]:
        inner = [definition(chart.states[name]) for name in state.children]
        transitions = [
            given(
                event=t.event,
                guard=t.guard,
                priority=-place,
                target=t.target and default(chart, t.target),
                action=lines(t.content),
            )
            for place, t in enumerate(state.transitions)
        ]
        return {
            "name": state.name,
            **({("parallel states" if state.is_parallel else "states"): inner} if inner else {}),
            **({"transitions": transitions} if transitions else {}),
            **given(initial=state.initial),
            **given(**{"on entry": lines(state.entry), "on exit": lines(state.exit)}),
        }

    def lines(content: Content) -> str | None:
        return "\n".join(f"{name} = {text}" for name, text in content) or None

    states = [definition(state) for state in chart.roots()]
    root = {"name": "root", "initial": chart.initial, "states": states}
    preamble = "\n".join(f"{name} = {value}" for name, value in chart.variables.items())
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


def in_statemachine(stream: Stream) -> Run:
    """Return the chart as a class of ``python-statemachine``."""
    factory = import_module("statemachine.io")
    chart, work = stream.chart, Work(stream.chart)

    def definition(state: State) -> dict[str, Any]:
        on: dict[str, list[dict[str, Any]]] = {}
        for t in state.transitions:
            functions = given(cond=work.guard(t.guard), on=work.content(t.content))
            on.setdefault(t.event, []).append({"target": t.target, **functions})
        first = chart.states[state.parent].initial if state.parent else chart.initial
        histories = [
            name for name, history in chart.histories.items() if history.parent == state.name
        ]
        inner = {name: definition(chart.states[name]) for name in state.children}
        return {
            "initial": state.name == first,
            "parallel": state.is_parallel,
            **given(enter=work.content(state.entry), exit=work.content(state.exit)),
            **({"on": on} if on else {}),
            **({"states": inner} if inner else {}),
            **({"history": {name: {"type": "deep"} for name in histories}} if histories else {}),
        }

    machine_class = factory.create_machine_class_from_definition(
        chart.name, {state.name: definition(state) for state in chart.roots()}
    )
    machine = machine_class()
    return Run(lambda events: [stream.names[event] for event in events], machine.send, work.values)


def in_pysm(stream: Stream) -> Run:
    """Return the chart as nested machines of ``pysm``."""
    pysm = import_module("pysm")
    chart, work = stream.chart, Work(stream.chart)
    top = pysm.StateMachine(chart.name)
    built: dict[str, Any] = {}

    def add(state: State, parent: Any, *, is_initial: bool) -> None:
        found = (pysm.StateMachine if state.children else pysm.State)(state.name)
        found.handlers = given(enter=work.content(state.entry), exit=work.content(state.exit))
        parent.add_state(found, initial=is_initial)
        built[state.name] = found
        for name in state.children:
            add(chart.states[name], found, is_initial=name == state.initial)

    for state in chart.roots():
        add(state, top, is_initial=state.name == chart.initial)
    for t in transitions_of(chart):
        built[t.source].parent.add_transition(
            built[t.source],
            built[t.target] if t.target else None,
            events=[t.event],
            **given(
                condition=work.guard(t.guard) or work.function("return True"),
                action=work.content(t.content),
            ),
        )
    top.initialize()
    start(chart, work)
    event_class = pysm.Event

    def send(name: str) -> None:
        top.dispatch(event_class(name))

    return Run(lambda events: [stream.names[event] for event in events], send, work.values)


@dataclass(frozen=True, slots=True)
class Peer:
    """A package of PyPI and how a chart is built with it."""

    package: str
    build: Callable[[Stream], Run]
    charts: str = "ABC"
    has_history: bool = True


PEERS = (
    Peer("pysm", in_pysm, charts="AB"),
    Peer("transitions", in_transitions, has_history=False),
    Peer("sismic", in_sismic, has_history=False),
    Peer("python-statemachine", in_statemachine),
)


def contender(peer: Peer, stream: Stream) -> Contender:
    """Return a chart in a package; `UnavailableError` if it is missing or cannot express it."""
    try:
        name = f"{peer.package} {version(peer.package)}"
    except ImportError:
        raise UnavailableError(
            f"the package {peer.package} is not installed; `make bench` installs it"
        ) from None
    if stream.letter not in peer.charts:
        raise UnavailableError(f"{peer.package} has no parallel states: no chart {stream.letter}")

    def start() -> Run:
        try:
            return peer.build(stream)
        except Exception as error:
            raise UnavailableError(f"{name}: {type(error).__name__}: {error}") from error

    return Contender(name, peer.package, start, peer.has_history)
