"""Read `board_a.io.yaml`: a board, its wires, and their meaning to the machines of its node."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

from fsmkit.carriers.wires import keys as wire_keys
from fsmkit.carriers.wires.bindings import BindingReader, needs_of
from fsmkit.carriers.wires.board import Board, Device, Formula
from fsmkit.carriers.wires.formulas import FormulaReader
from fsmkit.carriers.wires.signals import read_signals
from fsmkit.chart.loading import read_bytes
from fsmkit.diagnostics import Findings, FsmkitError, Text
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.document import keys
from fsmkit.language import BOOL, Scope, read_duration
from fsmkit.system.deployment.deployment import Deployment, deployment_of
from fsmkit.system.machines import Replacement
from fsmkit.yaml.encoding import decode
from fsmkit.yaml.nodes import Node, entries_of, read_nodes, require_record, require_text, texts_of

EXAMPLE = "write `board: a`, `deployment: deployment.yaml`, `period: 1ms`, `signals: {...}`"
HEADER = re.compile(r"[A-Za-z0-9_./+-]+", re.ASCII)
WORD = re.compile(r"[A-Za-z]\w*", re.ASCII)
SERVED = ("unconnected-input", "unconnected-event")
"""Findings about missing environments, for which a board has ``unbound-wire``."""
MOST_NOTICES = 16
"""Bits that an ``unsigned`` has on every machine."""


def board_of(
    root: Node | None,
    folder: Path,
    findings: Findings,
    replacing: Mapping[str, Replacement] = MappingProxyType({}),
    *,
    strict: bool = False,
) -> Board | None:
    """Read a board; paths in it are relative to ``folder``. Mind the findings.

    ``replacing``, ``strict``: as for `fsmkit.system.any_file.read`.
    """
    parts = require_record(root, wire_keys.BOARD, "a board", findings, keys.BELONGS)
    if root is None or parts is None:
        return None
    if not {"board", "deployment", "period"} <= set(parts):
        findings.add(
            "broken-board",
            "a board needs `board`, `deployment` and `period`",
            root.span,
            help=EXAMPLE,
        )
        return None
    name = require_text(parts["board"], "the node of a board", findings)
    deployment = _deployment(parts["deployment"], folder, findings, replacing, strict=strict)
    period = _period(parts["period"], findings)
    if name is None or deployment is None or period is None:
        return None
    node = _node(name, deployment, findings)
    signals = read_signals(parts.get("signals"), period, findings)
    if node is None or signals is None:
        return None
    reader = FormulaReader(deployment, node, period, signals, (), findings)
    devices = tuple(_devices(parts.get("use"), reader))
    reader.devices = devices
    bindings = BindingReader(reader)
    bindings.devices(devices)
    bindings.follow(parts.get("set"))
    bindings.machines(parts.get("bind"))
    off, kept = _off(parts.get("off"), reader)
    _report_shared_charts(deployment, node, name, findings)
    if findings.has_errors:
        return None
    bindings.report_unused()
    signals = tuple(replace(s, is_kept=n in kept) for n, s in enumerate(signals))
    return Board(
        name.value,
        deployment,
        node,
        period,
        signals,
        devices,
        tuple(bindings.inputs),
        tuple(bindings.events),
        tuple(bindings.ports),
        tuple(bindings.following),
        off,
    )


def _deployment(
    node: Node,
    folder: Path,
    findings: Findings,
    replacing: Mapping[str, Replacement],
    *,
    strict: bool,
) -> Deployment | None:
    file = require_text(node, "the path of the deployment", findings)
    if file is None:
        return None
    path = folder / file.value
    own = Findings()
    source = decode(read_bytes(path, file), str(path), own)
    found = None
    try:
        if source is not None:
            root = read_nodes(source, own)
            found = deployment_of(root, path.parent, own, replacing, strict=strict)
    except FsmkitError as error:
        own = Findings()
        own.extend(error.diagnostics)
    findings.extend(each for each in own if each.rule.name not in SERVED)
    return found


def _period(node: Node, findings: Findings) -> int | None:
    text = require_text(node, "`period`", findings)
    micros = None if text is None else read_duration(text, Scope(tick=1), findings)
    if micros == 0:
        findings.add(
            "broken-board", "the period must be positive", text, help="write `period: 1ms`"
        )
        return None
    return micros


def _node(name: Text, deployment: Deployment, findings: Findings) -> int | None:
    own = {deployment.nodes[number]: number for number in deployment.own_nodes}
    if name.value not in own:
        findings.add(
            "unknown-name",
            f"the deployment has no node `{name}` with machines of fsmkit",
            name,
            help=suggest(name.value, own, f"name one of {', '.join(own)}"),
        )
    return own.get(name.value)


def _devices(node: Node | None, reader: FormulaReader) -> list[Device]:
    found = []
    findings = reader.findings
    for name, value in entries_of(node, "`use`", findings):
        parts = require_record(value, wire_keys.DEVICE, f"the device `{name}`", findings)
        if parts is None:
            continue
        texts = {
            key: require_text(parts.get(key), f"`{key}`", findings) for key in ("header", "type")
        }
        header, type_ = texts["header"], texts["type"]
        if header is None or type_ is None:
            findings.add(
                "broken-board",
                f"the device `{name}` needs `header` and `type`",
                name,
                help="write `{header: drive.h, type: drive, reads: [...], writes: [...]}`",
            )
            continue
        notices = tuple(texts_of(parts.get("notices"), "`notices`", "a notice", findings))
        for text, pattern in (
            (name, WORD),
            (header, HEADER),
            (type_, WORD),
            *_notice_patterns(notices),
        ):
            if not pattern.fullmatch(text.value):
                findings.add("broken-board", f"`{text}` is not an identifier of C", text)
        if len(notices) > MOST_NOTICES:
            findings.add("broken-board", f"a device has at most {MOST_NOTICES} notices", name)
        found.append(
            Device(
                name.value,
                type_.value,
                header.value,
                _signals(parts.get("reads"), "reads", reader, is_output=False),
                _signals(parts.get("writes"), "writes", reader, is_output=True),
                tuple(notice.value for notice in notices),
                name.span,
            )
        )
    return found


def _notice_patterns(notices: tuple[Text, ...]) -> list[tuple[Text, re.Pattern[str]]]:
    return [(notice, WORD) for notice in notices]


def _signals(
    node: Node | None, key: str, reader: FormulaReader, *, is_output: bool
) -> tuple[int, ...]:
    """Return the signals that a device reads or writes."""
    found = []
    for text in texts_of(node, f"`{key}`", "a signal", reader.findings):
        number = reader.signal(text)
        if number is None:
            continue
        signal = reader.signals[number]
        if signal.is_input if is_output else signal.is_output:
            reader.findings.add(
                "unfit-wire",
                f"`{signal.name}` is an {'input' if is_output else 'output'}",
                text,
                secondary=[] if signal.span is None else [(signal.span, "declared here")],
                help=f"name it under `{'reads' if is_output else 'writes'}`",
            )
        found.append(number)
    return tuple(found)


def _off(node: Node | None, reader: FormulaReader) -> tuple[Formula | None, set[int]]:
    """Return the condition for safe outputs, and the outputs that keep their values."""
    parts = require_record(node, wire_keys.OFF, "`off`", reader.findings)
    if not parts:
        return None, set()
    text = require_text(parts.get("when"), "`when`", reader.findings)
    if text is None:
        reader.findings.add(
            "missing-key", "`off` needs `when`, a condition", None if node is None else node.span,
            help="write `off: {when: not power or estop}`",
        )  # fmt: skip
    when = None if text is None else reader.formula(text, BOOL, "`when` is")
    kept = _signals(parts.get("keep"), "keep", reader, is_output=True)
    return when, set(kept)


def _report_shared_charts(
    deployment: Deployment, node: int, name: Text, findings: Findings
) -> None:
    """Report machines that run the same C, so that their operations share a function."""
    machines = deployment.system.machines
    own = [n for n, place in enumerate(deployment.placed) if place == node]
    begins = {
        link.source
        for link in deployment.system.event_links
        if link.source in own and deployment.placed[link.target] is not None
    }
    for number in own:
        same = [n for n in own if machines[n].chart == machines[number].chart]
        if same[0] != number or len(same) == 1 or any(n in begins for n in same):
            continue
        if any(needs_of(deployment, n).ports for n in same):
            listed = ", ".join(f"`{machines[n].name}`" for n in same)
            findings.add(
                "unfit-wire",
                f"{listed} run the same C, so their operations have one function",
                name,
                help="give each a chart of its own that extends the common one",
            )
