"""Faults of one instruction in a binary for Cortex-M0."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterable, Iterator, Mapping
from random import Random

from devtools.seeded_faults.subject import Fault, Subject, Totals

NOP = 0x46C0


def instructions(subject: Subject) -> Iterator[tuple[int, int, str]]:
    """Yield address, code and function of each 16-bit Thumb instruction of the machine."""
    symbols = subject.emulator.image.symbols
    p = subject.program.prefix
    lines = subprocess.run(
        ["arm-none-eabi-objdump", "-d", "--no-show-raw-insn", str(subject.binary)],
        capture_output=True, text=True, check=True,
    ).stdout.splitlines()  # fmt: skip
    name = ""
    driver = symbols["certify_driver_end"].address
    for line in lines:
        if head := re.match(r"[0-9a-f]+ <(\w+)[.\w]*>:", line):
            name = head[1]
        elif found := re.match(r" +([0-9a-f]+):\t(\S+)", line):
            address = int(found[1], 16)
            is_own = name.startswith((f"{p}_", "fsm_")) and address >= driver
            if is_own and not found[2].startswith("."):
                code = int.from_bytes(subject.emulator.read(address, 2), "little")
                if code >> 11 < 0x1D:
                    yield address, code, name


def changes(code: int) -> Iterator[tuple[str, int]]:
    """Yield the faults of a Thumb instruction: kind and changed code."""
    top = code >> 11
    if code >> 12 == 0xD and code >> 8 & 15 < 14:
        yield "condition inverted", code ^ 0x100
    if top in (4, 5, 6, 7):  # MOVS, CMP, ADDS, SUBS with 8 bits
        yield "constant off by one", code & 0xFF00 | (code + 1) & 0xFF
    if top in (0, 1, 2, 12, 13, 14, 15, 16, 17):  # shifts, loads and stores with 5 bits
        yield "constant off by one", code & ~0x7C0 | (code + 0x40) & 0x7C0
    if code >> 13 in (0, 3) or code >> 12 in (5, 8) or code >> 10 == 0x10:
        yield "register swapped", code ^ 1
    if code >> 9 in (0x28, 0x29, 0x2A) or top in (12, 14, 16):
        yield "store dropped", NOP


def source_lines(subject: Subject, addresses: Iterable[int]) -> Mapping[int, str]:
    """Return the source line of each address: file, number and text."""
    listed = list(addresses)
    if not listed:
        return {}
    done = subprocess.run(
        ["arm-none-eabi-addr2line", "-s", "-e", str(subject.binary), *map(hex, listed)],
        capture_output=True, text=True, check=True,
    ).stdout.splitlines()  # fmt: skip
    found = {}
    for address, place in zip(listed, done, strict=True):
        file, _, number = place.split()[0].partition(":")
        text = subject.program.files.get(file, "").splitlines()
        has_line = number.isdigit() and 0 < int(number) <= len(text)
        found[address] = f"{file}:{number}: {text[int(number) - 1].strip() if has_line else ''}"
    return found


def binary_faults(subject: Subject, count: int, random: Random) -> Totals:
    """Seed faults in the binary, one at a time."""
    executed = subject.executed_addresses()
    possible = [
        (address, f"{address:#x} in {name}: {code:04x} to {changed:04x}", kind, changed)
        for address, code, name in instructions(subject)
        for kind, changed in changes(code)
        if changed != code
    ]
    totals = Totals()
    chosen = random.sample(possible, min(count, len(possible)))
    places = source_lines(subject, [address for address, *_ in chosen])
    for address, where, kind, changed in chosen:
        fault = Fault(f"{where}, {places[address]}", kind)
        if address not in executed:
            totals.never_executed.append(fault)
            continue
        subject.emulator.reload(address, changed.to_bytes(2, "little"))
        if subject.binary_differs():
            totals.found += 1
        else:
            totals.survived.append(fault)
    subject.emulator.reload()
    return totals
