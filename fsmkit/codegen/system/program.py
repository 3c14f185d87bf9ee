"""From what was read to files: the machines of a chart, a system or a deployment, and their links.

A system becomes its machines; in C with what connects them. A deployment becomes a folder for each
node, with what links it to the others, and ``links.json``; a board, what its wires mean to a node.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from fsmkit.chart.chart import Chart
from fsmkit.codegen.system.files import BoardFiles, DeploymentPackage, files_of, packages
from fsmkit.codegen.system.parts import named_charts
from fsmkit.codegen.target import Generated, SystemTarget, Target
from fsmkit.diagnostics import Findings, FsmkitError, fail
from fsmkit.plugins import plugin, plugins
from fsmkit.system.any_file import Model
from fsmkit.system.board import Board
from fsmkit.system.channels import without_channels
from fsmkit.system.machine import EventLink, InputLink
from fsmkit.system.system import System
from fsmkit.system.without_environment import WithoutWorld, without_world

if TYPE_CHECKING:
    from fsmkit.codegen.system.node import Node
    from fsmkit.system.deployment.deployment import Deployment


WORLD = "world"
"""The part of a system that is generated only if ``with`` names it."""


@dataclass(frozen=True, slots=True)
class Program:
    """The files by relative path, and each machine with what was made of it."""

    files: Mapping[str, str | bytes]
    machines: tuple[tuple[Chart, Generated], ...]


def program_of(
    model: Model | Board, target: str, findings: Findings, options: Mapping[str, str]
) -> Program:
    """Return the files of a chart, a system, a deployment, or the wires of a board.

    Args:
        model: What `fsmkit.system.any_file.read_with_boards` returns.
        target: The name of a target: ``c``, ``python`` ...
        findings: Where warnings are left.
        options: The target's own; a prefix is for a chart alone.

    Raises:
        FsmkitError: ``unknown-plugin``, ``wrong-option``; or with every finding, where the target
            cannot express the model.

    """
    maker = plugin(Target, target)
    if isinstance(model, Chart):
        options, _ = _with_world(options)
        _require_options(maker, model, options)
        return _program((model,), None, maker, options, findings)
    if isinstance(model, Board):
        if target != "c" or options:
            raise fail(
                "wrong-option",
                "a board is compiled to C, without options",
                help="give the options to its deployment",
            )
        return Program(plugin(BoardFiles, model.board_kind).board_files(model), ())
    options, is_whole = _with_world(options)
    _require_options(maker, model, options)
    if not isinstance(model, System):
        for carrier in files_of(model):
            rejection = carrier.rejection(model, "c" if "package" in options else target)
            if rejection is not None:
                raise rejection
        if (package := packages().get(options.get("package", ""))) is not None:
            return _packed_program(package, model, options, findings)
    is_joined = target == "c"
    if isinstance(model, System):
        whole = without_channels(model)
        if isinstance(maker, SystemTarget):
            return _one(whole, maker, options, findings)
        left = WithoutWorld(whole) if is_whole else without_world(whole, findings)
        charts = named_charts(left.system, is_joined=is_joined)
        if not is_joined:
            runner = "fsmkit.runtime.system_session.SystemSession"
            _report_unjoined(left.system, maker, runner, findings)
        return _program(charts, left if is_joined else None, maker, options, findings)
    from fsmkit.codegen.system.node import nodes_of

    if not is_joined:
        _report_unjoined(model.system, maker, "fsmkit.Node", findings)
    files: dict[str, str | bytes] = {"links.json": model.map.as_json()}
    for carrier in files_of(model):
        files |= carrier.files(model)
    machines: list[tuple[Chart, Generated]] = []
    for node in nodes_of(replace(model, system=without_channels(model.system))):
        made = _program(node.charts, node if is_joined else None, maker, options, findings)
        machines += made.machines
        files |= {f"{node.name}/{path}": text for path, text in made.files.items()}
    return Program(files, tuple(machines))


def _report_unjoined(system: System, maker: Target, runner: str, findings: Findings) -> None:
    """Report that no code connects the machines of a system; ``runner``: a command that does."""
    joins: tuple[EventLink | InputLink, ...] = (*system.event_links, *system.input_links)
    for link in joins[:1]:
        findings.add(
            "unjoined-machines",
            f"the target `{maker.name}` generates the machines of `{system.name}`, but not "
            "their connections",
            system.machines[link.target].span,
            help=f"connect them in your program, run them by `{runner}`, or compile to C",
        )


def _with_world(options: Mapping[str, str]) -> tuple[dict[str, str], bool]:
    """Return the options without the part ``world``, and whether it was among them."""
    parts = [part.strip() for part in options.get("with", "").split(",")]
    if WORLD not in parts:
        return dict(options), False
    rest = ",".join(part for part in parts if part != WORLD)
    return {n: v for n, v in options.items() if n != "with"} | (
        {"with": rest} if rest else {}
    ), True


def _packed_program(
    package: DeploymentPackage,
    deployment: Deployment,
    options: Mapping[str, str],
    findings: Findings,
) -> Program:
    """Return the package of a deployment, whose programs are in C."""
    from fsmkit.codegen.system.node import nodes_of
    from fsmkit.codegen.system.node_printer import compose_node

    rest = {name: value for name, value in options.items() if name != "package"}
    maker = plugin(Target, "c")
    nodes = nodes_of(replace(deployment, system=without_channels(deployment.system)))
    made = {}
    for node in nodes:
        found = _program(node.charts, None, maker, rest, findings)
        queued = frozenset(
            chart.name for chart, each in found.machines if each.figures.get("queue")
        )
        texts = {path: str(text) for path, text in found.files.items()}
        made[node.name] = Program(texts | compose_node(node, queued), found.machines)
    folders = {name: {p: str(t) for p, t in each.files.items()} for name, each in made.items()}
    files: dict[str, str | bytes] = {**package.packed(deployment, folders, nodes)}
    return Program(files, tuple(m for each in made.values() for m in each.machines))


def _one(
    system: System, maker: SystemTarget, options: Mapping[str, str], findings: Findings
) -> Program:
    """Return the program of a target that joins the machines."""
    made = maker.generate_system(system, findings, options)
    if made is None or findings.has_errors:
        raise FsmkitError(findings)
    return Program(_united([made]), ())


def _require_options(maker: Target, model: Model, options: Mapping[str, str]) -> None:
    for name in sorted(set(options).difference(maker.options)):
        known = [each.name for each in plugins(Target) if name in each.options]
        raise fail(
            "wrong-option",
            f"the target `{maker.name}` has no option `{name}`",
            help=f"it is for {' and '.join(known)}" if known else f"use {_listed(maker.options)}",
        )
    prefix = options.get("prefix")
    if prefix is not None and not isinstance(model, Chart):
        raise fail(
            "wrong-option",
            "a prefix names one machine; a system has several",
            help="name the machines in the system",
        )
    if prefix is not None and not re.fullmatch(r"[A-Za-z]\w*", prefix, re.ASCII):
        raise fail(
            "wrong-option",
            f"the prefix `{prefix}` is not an identifier",
            help="use letters, digits and `_`, a letter first",
        )
    package = packages().get(options.get("package", ""))
    if package is not None and isinstance(model, Chart):
        raise fail(
            "wrong-option",
            f"the package `{package.package}` is built from a deployment, not from a chart",
            help=f"write one with a node `foreign: {package.name}`, or compile a chart without "
            "`--package`",
        )
    is_packed = package is not None and not isinstance(model, Chart | System)
    if not isinstance(model, Chart) and "package" in options and not is_packed:
        raise fail(
            "wrong-option",
            "a package holds one machine; a system has several",
            help="build a package for each chart",
        )
    if not isinstance(model, Chart) and "queue" in options.get("without", "").split(","):
        raise fail(
            "wrong-option",
            "the machines of a system need their queues",
            help="omit another part",
        )


def _listed(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names) or "no option"


def _program(
    charts: tuple[Chart, ...],
    joined: WithoutWorld | Node | None,
    maker: Target,
    options: Mapping[str, str],
    findings: Findings,
) -> Program:
    """Return the machines of a program, and its files; ``joined``: what joins them in C."""
    once = [chart for place, chart in enumerate(charts) if chart not in charts[:place]]
    made = [(chart, maker.generate(chart, findings, options)) for chart in once]
    machines = tuple((chart, each) for chart, each in made if each is not None)
    if len(machines) < len(once) or findings.has_errors:
        raise FsmkitError(findings)
    parts = [each for _, each in machines]
    queued = frozenset(chart.name for chart, each in machines if each.figures.get("queue"))
    if isinstance(joined, WithoutWorld):
        from fsmkit.codegen.system.glue import compose

        files = compose(joined.system, charts, queued, findings, joined.outside)
        parts.append(Generated({**files}, {}))
    elif joined is not None:
        from fsmkit.codegen.system.node_printer import compose_node

        files = compose_node(joined, queued)
        for carrier in files_of(joined.deployment):
            files |= carrier.node_files(joined)
        parts.append(Generated(files, {}))
    return Program(_united(parts), machines)


def _united(generated: Iterable[Generated]) -> dict[str, str | bytes]:
    """Return the files of several machines without duplicates."""
    files: dict[str, str | bytes] = {}
    for made in generated:
        contents: dict[str, str | bytes] = {**made.files, **made.built}
        for path, content in contents.items():
            if files.setdefault(path, content) != content:
                raise fail(
                    "duplicate-output",
                    f"two machines would be written to `{path}`",
                    help="give the charts different names",
                )
    return files
