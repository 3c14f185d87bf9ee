"""The certificate: what was compared, by which tools, with what result."""

from __future__ import annotations

import hashlib
import json
import platform
import subprocess
from collections.abc import Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import fail
from fsmkit.diagnostics.parsing import parse_json
from fsmkit.document.document import Trigger
from fsmkit.emit.version import VERSION
from fsmkit.plan.fingerprint import fingerprint
from fsmkit.runtime.interpreter.index import index_of
from fsmkit.verify.certify.comparison import Comparison, Request, reasons
from fsmkit.verify.certify.processors import Processor
from fsmkit.verify.certify.steps import REPEATED
from fsmkit.verify.certify.target import Binary

FORMAT = 1
"""The version of the form of a certificate."""
COMPLETE, PARTIAL, DIFFERENT = "complete", "partial", "different"
HOST = "x86-64"
NOT_COMPARED = ("sha256", "seconds", "versions")
"""Keys that may differ when a certificate is made again."""


def certificate(
    chart: Chart,
    comparison: Comparison,
    request: Request,
    *,
    processor: Processor | None,
    command: Sequence[str],
    host_command: Sequence[str],
    binary: Binary | None,
    objects: Mapping[str, bytes],
) -> dict[str, Any]:
    """Return the certificate of a comparison, sealed by its hash."""
    program, absent = comparison.program, comparison.steps.absent
    names = [name for name in program.shipped if name in program.files]
    result = COMPLETE if comparison.is_complete else PARTIAL
    if comparison.differences:
        result = DIFFERENT
    document: dict[str, Any] = {
        "certificate": FORMAT,
        "result": result,
        "reasons": reasons(comparison, request),
        "chart": str(chart.name),
        "fingerprint": fingerprint(chart),
        "sources": [{"file": name, "sha256": found} for name, found in sources(chart).items()],
        "target": HOST if processor is None else processor.name,
        "compiler": _compiler(command),
        "host": {"processor": platform.machine(), "compiler": _compiler(host_command)},
        "form": request.form or "default",
        "prefix": request.prefix,
        "command": list(request.command),
        "parameters": dict(request.parameters),
        "firmware": None,
        "generated": {name: sha256(program.files[name].encode()) for name in names},
        "objects": {
            name: sha256(data)
            for name, data in (objects if binary is None else binary.objects).items()
        },
        "states": comparison.explored,
        "states_left": len(comparison.states) - comparison.explored,
        "steps": comparison.taken,
        "interpreted": comparison.steps.interpreted,
        "emulated": comparison.emulated if processor is not None else None,
        "repeated": comparison.repeated,
        "classes": _classes(comparison),
        "limit": request.limit,
        "coverage": coverage(chart, comparison),
        "maxima": maxima(comparison, processor),
        "differences": [
            {"step": str(d.step), "path": list(map(str, d.path)), "what": d.what}
            for d in comparison.differences
        ],
        "assumptions": assumptions(
            comparison, processor, absent, is_firmware=request.firmware is not None
        ),
        "versions": _versions(processor),
        "seconds": {
            name: round(getattr(comparison.seconds, name), 1)
            for name in ("interpreter", "host", "emulator")
        },
    }
    if request.firmware is not None:
        document["firmware"] = {
            "file": str(request.firmware), "sha256": hash_of(request.firmware),
        }  # fmt: skip
    return seal(document)


def seal(document: dict[str, Any]) -> dict[str, Any]:
    """Return a certificate with the hash of its content."""
    content = {key: value for key, value in document.items() if key != "sha256"}
    return {**content, "sha256": sha256(canonical(content))}


def canonical(content: Mapping[str, Any]) -> bytes:
    """Return the bytes of a certificate that are hashed: JSON with sorted keys, without spaces."""
    return json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=True).encode()


def sha256(data: bytes) -> str:
    """Return the SHA-256 of bytes, in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def hash_of(path: Path) -> str:
    """Return the SHA-256 of a file."""
    return sha256(path.read_bytes())


def sources(chart: Chart) -> dict[str, str]:
    """Return the files of a chart and its bases, with the SHA-256 of their text."""
    return {str(each.name): sha256(str(each.text).encode()) for each in chart.sources}


def _classes(comparison: Comparison) -> int:
    """Return the number of classes of external values: payloads, inputs, results."""
    closed = comparison.closed
    results = sum(len(values) for each in closed.results for values in each.values())
    inputs = sum(len(free.values) for free in closed.free_inputs)
    return len(comparison.steps.events) + inputs + results


def coverage(chart: Chart, comparison: Comparison) -> dict[str, dict[str, int]]:
    """Return how many states, transitions, and pairs of state and event were executed."""
    covered = comparison.steps.coverage
    leaves = index_of(chart).leaves
    events = {each.event for each in comparison.steps.events}
    active = {
        leaf
        for state in comparison.states[: comparison.explored]
        if state.running
        for leaf in state.configuration & leaves
    }
    transitions = [t for t in chart.transitions if t.trigger is not Trigger.INITIAL or t.content]
    states = [s.index for s in chart.states if s.index and not s.is_history]
    return {
        "states": {"covered": len(covered.states & set(states)), "all": len(states)},
        "transitions": {"covered": len(covered.transitions), "all": len(transitions)},
        "pairs": {"covered": len(active) * len(events), "all": len(leaves) * len(events)},
    }


def maxima(comparison: Comparison, processor: Processor | None) -> list[dict[str, Any]]:
    """Return the greatest numbers of each kind of step, by name."""
    has_cycles = processor is not None and processor.taken > 0
    return [
        {
            "step": str(name),
            "instructions": found.instructions,
            "stack": found.stack,
            "cycles": found.cycles if has_cycles else None,
            "path": [*map(str, comparison.path(found.state)), str(name)],
        }
        for name, found in sorted(comparison.maxima.items())
    ]


def assumptions(
    comparison: Comparison,
    processor: Processor | None,
    absent: Sequence[str],
    *,
    is_firmware: bool,
) -> list[str]:
    """Return what a certificate takes for granted, a sentence each."""
    found = [
        (
            "From each class of values with the same effect on the chart, one was tried; "
            "each kind of step was repeated with their bounds, "
            f"and 1 in {REPEATED} steps with others."
        ),
        "Pending timers had their whole delay left, or one tick; any of them expired first.",
        (
            "The host calls `run` before it dispatches or posts the next event; "
            "several events at once were only sampled."
        ),
        (
            "Functions of the host return. Once for each kind of step, they looked at the machine, "
            "posted to it, and called functions that a step excludes."
        ),
    ]
    found += [
        f"{what} is only sampled: {use.text}." for what, use in comparison.closed.samples.items()
    ]
    if processor is not None:
        found.append("The emulator executes instructions as the processor does.")
        found.append(
            "Where the binary accesses none of the inputs that differ, the emulator executed one "
            "of these steps: the others are the same execution."
        )
        if not is_firmware:
            found.append("`memcpy`, `memset`, `memmove` and `memcmp` are those of fsmkit.")
        found.append(
            "Stack: the bytes that the machine's functions write below the caller's frame; "
            "functions of the host and interrupts need more."
        )
    if processor is not None and processor.taken:
        found.append("Cycles: memory never waits, and a multiplication takes one cycle.")
    if comparison.program.names.invoked:
        found.append(
            "The counters, and the next deadline during calls, were not compared: other machines "
            "run in slots of this one."
        )
    if absent:
        functions = ", ".join(f"`{comparison.program.prefix}_{name}`" for name in absent)
        found.append(f"The firmware does not contain {functions}; these are not compared.")
    if not comparison.program.is_default:
        found.append("The machine was generated with `--with save`, which numbers its strings.")
    return found


def _compiler(command: Sequence[str]) -> str:
    try:
        done = subprocess.run(
            [command[0], "--version"], capture_output=True, text=True, check=False, timeout=20
        )
    except (OSError, subprocess.TimeoutExpired):
        return " ".join(command)
    first = done.stdout.splitlines()[:1]
    return f"{' '.join(command)} ({first[0].strip() if first else 'unknown version'})"


def _versions(processor: Processor | None) -> dict[str, str]:
    found = {"fsmkit": VERSION, "python": platform.python_version()}
    for name in ("unicorn",) if processor is not None else ():
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "unknown"
    return found


# --- checking a certificate --------------------------------------------------------------------


def read(path: Path) -> dict[str, Any]:
    """Return the certificate in a file. Raises `FsmkitError` for an edited one and other files."""
    try:
        document = parse_json(path.read_bytes())
    except (OSError, ValueError) as error:
        raise fail(
            "wrong-certificate",
            f"`{path}` is not a certificate: {error}",
            help="`fsmkit certify CHART` writes certificate.json",
        ) from error
    if not isinstance(document, dict) or document.get("certificate") != FORMAT:
        raise fail(
            "wrong-certificate",
            f"`{path}` is not a certificate of this version of fsmkit",
            help="`fsmkit certify CHART` writes certificate.json",
        )
    if seal(document)["sha256"] != document.get("sha256"):
        raise fail(
            "wrong-certificate",
            f"`{path}` was edited: its content does not match its hash",
            help="make it again: `fsmkit certify CHART`",
        )
    return document


def changes(document: Mapping[str, Any], chart: Chart, generated: Mapping[str, str]) -> list[str]:
    """Return what has changed since a certificate was made: sources, generated files, firmware."""
    found = []
    if document["fingerprint"] != fingerprint(chart):
        found.append(f"the chart `{chart.name}` means something else now")
    known = {Path(each["file"]).name: each["sha256"] for each in document["sources"]}
    for name, own in sources(chart).items():
        if known.get(Path(name).name) != own:
            found.append(f"`{name}` has changed")
    for name, text in sorted(generated.items()):
        if document["generated"].get(name) != sha256(text.encode()):
            found.append(f"the generated file `{name}` is different")
    firmware = document["firmware"]
    if firmware is not None:
        path = Path(firmware["file"])
        if not path.is_file():
            found.append(f"the firmware `{path}` is missing")
        elif hash_of(path) != firmware["sha256"]:
            found.append(f"the firmware `{path}` has changed")
    return found


def compared(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[str]:
    """Return the keys of two certificates whose values differ, but for times and versions."""
    return [
        key
        for key in sorted(old.keys() | new.keys())
        if key not in NOT_COMPARED and old.get(key) != new.get(key)
    ]
