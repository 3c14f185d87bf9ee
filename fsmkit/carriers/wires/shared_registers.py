"""Check wires in a window of registers: they are disjoint, and each register is of one kind."""

from __future__ import annotations

from fsmkit.carriers.wires.board import Kind, Signal
from fsmkit.diagnostics import Findings


def report_shared_registers(signals: tuple[Signal, ...], findings: Findings) -> bool:
    """Report the first error in registers; return whether there is any."""
    wires = [signal for signal in signals if signal.kind is not Kind.FLAG]
    with_one = [signal for signal in wires if signal.register is not None]
    if with_one and len(with_one) < len(wires):
        missing = next(signal for signal in wires if signal.register is None)
        findings.add(
            "broken-board",
            f"`{missing.name}` has no register, and others have one",
            missing.span,
            help="give each wire a register, or none",
        )
        return True
    bits: dict[int, Signal] = {}
    bytes_: dict[int, Signal] = {}
    for signal in with_one:
        register = signal.register
        assert register is not None  # noqa: S101  (it has one)
        lowest = register.offset * 8 + register.shift
        for bit in range(lowest, lowest + register.bits):
            first = bits.setdefault(bit, signal)
            if first is not signal:
                message = f"`{signal.name}` and `{first.name}` have a bit in common"
                return _shared(first, signal, message, "move one of them", findings)
        for byte in range(register.offset, register.offset + register.access // 8):
            first = bytes_.setdefault(byte, signal)
            if _access(first) != _access(signal):
                message = f"`{signal.name}` and `{first.name}` are accessed in different ways"
                advice = "give inputs and outputs registers of their own, and all wires of a "
                advice += "register the same `at` and `access`"
                return _shared(first, signal, message, advice, findings)
    return False


def _access(signal: Signal) -> tuple[int, int, bool]:
    register = signal.register
    assert register is not None  # noqa: S101  (only such are compared)
    return register.offset, register.access, signal.is_output


def _shared(first: Signal, second: Signal, message: str, advice: str, findings: Findings) -> bool:
    findings.add(
        "wire-used-twice",
        message,
        second.span,
        secondary=[] if first.span is None else [(first.span, "here")],
        help=advice,
    )
    return True
