"""Convert a path of SPIN to a counterexample, performed by the interpreter and generated C.

``spin -t -p`` prints each statement of a path with its line in the model; a line is one step.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from contextlib import closing
from dataclasses import replace
from pathlib import Path

from fsmkit.diagnostics import Findings, FsmkitError, fail
from fsmkit.export.changes import Joint, joint_moves
from fsmkit.export.collect import network_of
from fsmkit.export.components import Parts
from fsmkit.export.exporter import ExportOptions
from fsmkit.export.network import Move, Network
from fsmkit.export.promela.model import claim_names, write_model
from fsmkit.system.properties.property import Property
from fsmkit.system.system import System
from fsmkit.verify.engines.c.engine import CEngine, compiler
from fsmkit.verify.report.counterexample import Counterexample, ReplayError, write
from fsmkit.verify.statespace.actions import Action, Step
from fsmkit.verify.statespace.exploration import Trail
from fsmkit.verify.statespace.global_steps import GlobalSteps

STATEMENT = re.compile(r"\s*(\d+):\s*proc\s+\d+ \([^)]*\) (\S+):(\d+) \(state")
CLAIM = re.compile(r"proc\s+- \((\w+):\d+\)")
OPTION = ":: d_step {"


def counterexample_of(
    system: System, options: ExportOptions, path: Path
) -> tuple[Network, Property | None, Counterexample]:
    """Return the path beside a model (``x.pml``), or in the output of SPIN (other files).

    Also returns the property whose claim it violates, if that is known. Raises `FsmkitError`:
    ``no-spin``; ``foreign-trail`` if it is not a path of the system.
    """
    network = network_of(system, options)
    text = write_model(network)
    printed = _printed(path, text) if path.suffix == ".pml" else _read(path)
    trail = _trail(network, text, printed, path)
    try:
        found = write(network.closed, trail)
    except ReplayError as error:
        raise _foreign(path, str(error)) from error
    return network, _property(network, printed), _confirmed(network, found)


class _Walk:
    """The local states of the machines on a path, as moves of the network change them."""

    def __init__(self, network: Network, start: int) -> None:
        self._network = network
        self._at = [place.local for place in network.initial[start]]

    def take(self, machine: int, option: Joint) -> Move | None:
        """Perform the move of an option that starts here; None: there is no such move."""
        found = next((move for move in option.moves if move.source == self._at[machine]), None)
        if found is not None:
            self._at[machine] = found.target
            for sent in found.sent:
                self._receive(sent.target, sent.message)
        return found

    def elapse(self) -> None:
        """Let a unit of time pass."""
        automata = self._network.automata
        self._at = [a.elapsed.get(at, at) for a, at in zip(automata, self._at, strict=True)]

    def _receive(self, target: int, message: int) -> None:
        automaton = self._network.automata[target]
        if automaton.queues(message):
            return
        after, is_full = automaton.receives.get((self._at[target], message), (None, True))
        if after is not None and not is_full:
            self._at[target] = after


def _printed(model: Path, text: str) -> str:
    if _read(model) != text:
        raise _foreign(model, "the model does not match this system")
    spin = shutil.which("spin")
    if spin is None:
        raise fail("no-spin", "`spin` is not installed", help="install it, or see `fsmkit explain`")
    if not model.with_name(f"{model.name}.trail").exists():
        raise _foreign(model, f"there is no path: `{model.name}.trail` is missing")
    done = subprocess.run(
        [spin, "-t", "-p", model.name],
        cwd=model.parent,
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stdout


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not a text"
        raise fail("unreadable-file", f"cannot read `{path}`: {reason}".lower()) from error


def _trail(network: Network, text: str, printed: str, path: Path) -> Trail:
    """Return the steps of the lines, in their order; statements of a step have its number."""
    lines = [n for n, line in enumerate(text.splitlines(), 1) if line.lstrip().startswith(OPTION)]
    starts = {line: number for number, line in enumerate(lines[: len(network.starts)])}
    clock = lines.pop() if network.closed.unit else None
    codes = Parts(network).codes
    joints = (
        (machine, option)
        for machine, automaton in enumerate(network.automata)
        for option in joint_moves(automaton, codes[machine])
    )
    options = dict(zip(lines[len(starts) :], joints, strict=True))
    found: dict[str, tuple[Step, ...]] = {}
    walk: _Walk | None = None
    performed = printed.partition("spin: trail ends")[0]
    for match in filter(None, map(STATEMENT.match, performed.splitlines())):
        number, line = match[1], int(match[3])
        if number in found:
            continue
        if line in starts:
            walk = _Walk(network, starts[line])
            found[number] = network.starts[starts[line]]
        elif walk is not None and line == clock:
            walk.elapse()
            found[number] = (Step(Action.ELAPSE),)
        else:
            move = walk.take(*options[line]) if walk is not None and line in options else None
            if move is None:
                raise _foreign(path, f"line {line} of the model is no step there")
            found[number] = (move.step,)
    if not found:
        raise _foreign(path, "there is no step in it")
    return tuple(found.values())


def _property(network: Network, printed: str) -> Property | None:
    match = CLAIM.search(printed)
    properties = network.closed.system.properties
    names = dict(zip(claim_names(properties), properties, strict=True))
    return None if match is None else names.get(match[1])


def _confirmed(network: Network, found: Counterexample) -> Counterexample:
    """Perform the path in generated C as well."""
    if compiler() is None:
        return found
    with closing(CEngine(network.closed, Findings())) as engine:
        path = _ordinals(GlobalSteps(network.closed), found.trail)
        if engine.trail(path) != found.trail:
            return replace(found, replayed=(), differs="generated C takes other steps")
        return engine.confirm(found, path)


def _ordinals(steps: GlobalSteps, trail: Trail) -> tuple[int, ...]:
    """Return the ordinals of steps among the possible ones, as the engines count them."""
    found = []
    edges = steps.initial()
    for steps_taken in trail:
        ordinal, edge = next((n, e) for n, e in enumerate(edges) if e.steps == steps_taken)
        found.append(ordinal)
        edges = steps.successors(edge.to)
    return tuple(found)


def _foreign(path: Path, why: str) -> FsmkitError:
    return fail(
        "foreign-trail",
        f"`{path}` is not a path of this system: {why}",
        help="export the model again, with the same options, and let SPIN search that",
    )
