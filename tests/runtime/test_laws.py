"""What holds of every chart, tried on random ones."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import pytest

from devtools.random_charts.charts import random_document
from devtools.random_charts.choices import SeededChoices
from devtools.random_charts.scripts import random_script
from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.document.document import Kind
from fsmkit.language import Value
from fsmkit.plan.image import image_of
from fsmkit.runtime import interpreter, saving, snapshot_bytes
from fsmkit.runtime.interpreter import Macrostep, Snapshot, Timeout
from fsmkit.runtime.interpreter.index import index_of
from fsmkit.runtime.interpreter.snapshot import Posted
from fsmkit.runtime.interpreter.trace import trace_lines
from fsmkit.runtime.script import Player, SeededHost, script_texts
from tests.parameters import sampled

SEEDS = range(40)


@cache
def chart_of(seed: int) -> Chart:
    findings = Findings()
    chart = elaborate((random_document(SeededChoices(seed)),), findings)
    assert chart is not None, list(findings)
    return chart


class ConstantHost(SeededHost):
    """Operations without a memory."""

    def call(self, operation: str, arguments: tuple[Value, ...]) -> Value | None:
        self.state = 1
        return super().call(operation, arguments)


def performed(chart: Chart, seed: int, host: SeededHost | None = None) -> Iterator[Macrostep]:
    """Yield the macrosteps of a random script."""
    player = Player(chart)
    player.host = host or player.host
    for line in script_texts(random_script(SeededChoices(f"laws {seed}"), chart)):
        yield from (step for step in player.play(line) if isinstance(step, Macrostep))


@cache
def macrosteps(seed: int) -> tuple[Macrostep, ...]:
    return tuple(performed(chart_of(seed), seed))


def is_legal(chart: Chart, snapshot: Snapshot) -> bool:
    """SCXML 3.11: one child of each active compound state, all of each active parallel one."""
    active, children = snapshot.configuration, index_of(chart).children
    for state in chart.states:
        below = [child for child in children[state.index] if child in active]
        if state.index not in active:
            if below:
                return False
        else:
            regions = len(children[state.index])
            wanted = {Kind.COMPOUND: 1, Kind.PARALLEL: regions}.get(state.kind, 0)
            if len(below) != wanted:
                return False
    return not any(chart.states[state].is_history for state in active)


@pytest.mark.parametrize("seed", sampled(SEEDS, every=4))
def test_configurations_are_legal(seed: int) -> None:
    chart = chart_of(seed)
    for step in macrosteps(seed):
        assert is_legal(chart, step.after)


@pytest.mark.parametrize("seed", sampled(SEEDS, every=4))
def test_timers_belong_to_active_states_and_are_in_order(seed: int) -> None:
    chart = chart_of(seed)
    for step in macrosteps(seed):
        timers = step.after.timers
        assert list(timers) == sorted(timers, key=lambda timer: timer.deadline)
        for timer in timers:
            if isinstance(timer.what, Timeout):
                source = chart.transitions[timer.what.transition].source
                assert source in step.after.configuration


@pytest.mark.slow
@pytest.mark.parametrize("seed", sampled(SEEDS, every=4))
def test_capacities_bound_everything(seed: int) -> None:
    chart = chart_of(seed)
    for step in macrosteps(seed):
        after, most = step.after, chart.capacities
        delayed = [timer for timer in after.timers if not isinstance(timer.what, Timeout)]
        assert len(after.queue) + len(after.deferred) <= most.queue
        assert len(delayed) <= most.delayed
        assert sum(bool(small.transitions) for small in step.microsteps) <= most.microsteps


@pytest.mark.parametrize("seed", sampled(SEEDS, every=4))
def test_effects_agree_with_the_sets_of_a_microstep(seed: int) -> None:
    for step in macrosteps(seed):
        active = set(step.before.configuration) or {0}
        for small in step.microsteps:
            if not step.after.finished:
                assert set(small.exited) <= active
            active = active - set(small.exited) | set(small.entered)
        if not step.after.finished:
            assert active == step.after.configuration


@pytest.mark.parametrize("seed", sampled(SEEDS, every=4))
def test_a_step_is_a_function_of_snapshot_event_and_host(seed: int) -> None:
    chart = chart_of(seed)
    host = ConstantHost(chart)
    for done in performed(chart, seed, host):
        posts = any(isinstance(effect, Posted) for effect in done.effects)
        if isinstance(done.event, interpreter.Occurrence | Timeout) and not posts:
            again = interpreter.step(chart, done.before, done.event, host)
            dispatched = interpreter.step(chart, done.before, done.event, host, may_defer=False)
            same_time = interpreter.at_time(done.after, again.after.now)
            assert same_time in (again.after, dispatched.after)


@pytest.mark.parametrize("seed", sampled(SEEDS, every=4))
def test_running_in_pieces_is_running_at_once(seed: int) -> None:
    chart = chart_of(seed)
    if index_of(chart).samples_inputs:
        return  # it looks at its inputs in each run, so pieces are not alike
    traces = []
    for times in ((0, 200), (0, 1, 7, 30, 31, 99, 150, 200)):
        host = SeededHost(chart)
        steps = [interpreter.start(chart, 0, host)]
        for now in times:
            current = interpreter.at_time(steps[-1].after, max(0, now - 1))
            steps += interpreter.run(chart, current, now, host)
        traces.append(list(trace_lines(chart, steps)))
    assert traces[0] == traces[1]


@pytest.mark.parametrize("seed", sampled(SEEDS, every=4))
def test_saved_and_restored_is_the_same(seed: int) -> None:
    chart = chart_of(seed)
    for step in macrosteps(seed):
        saved = json.loads(json.dumps(saving.save(chart, step.after)))
        assert saving.restore(chart, saved, step.after.now) == step.after


@pytest.mark.slow
@pytest.mark.parametrize("seed", sampled(SEEDS, every=4))
def test_saved_as_bytes_and_restored_is_the_same(seed: int) -> None:
    chart = chart_of(seed)
    sizes = {image_of(chart).total}
    for step in macrosteps(seed):
        try:
            saved = snapshot_bytes.pack(chart, step.after)
        except FsmkitError:  # a symbol that the chart does not mention
            continue
        sizes.add(len(saved))
        restored = snapshot_bytes.unpack(chart, saved, step.after.now)
        expected = step.after
        if not expected.running:  # nothing waits for it any more
            expected = replace(expected, queue=(), deferred=(), timers=())
        fault = expected.fault
        named = replace(restored, fault=fault if restored.fault == "error.*" else restored.fault)
        assert named == expected
    assert len(sizes) == 1


def test_what_is_no_snapshot_is_refused() -> None:
    chart = chart_of(SEEDS[0])
    (step, *_) = macrosteps(SEEDS[0])
    saved = snapshot_bytes.pack(chart, step.after)
    for place in range(len(saved)):
        for wrong in (
            saved[:place],
            saved[:place] + bytes([saved[place] ^ 4]) + saved[place + 1 :],
        ):
            with pytest.raises(FsmkitError) as caught:
                snapshot_bytes.unpack(chart, wrong, 0)
            assert caught.value.diagnostics[0].rule.name == "foreign-snapshot"


def test_fingerprints_tell_charts_apart() -> None:
    assert len({saving.fingerprint(chart_of(seed)) for seed in SEEDS}) == len(SEEDS)
