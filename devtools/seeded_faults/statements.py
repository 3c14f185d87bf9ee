"""Faults of one statement in the generated C and its library."""

from __future__ import annotations

import re
from collections.abc import Iterator
from random import Random

from devtools.seeded_faults.subject import CompilationError, Fault, Subject, Totals

STATEMENT = re.compile(r"^ +[^/#].*;(?: /\*.*\*/)?$")
NUMBER = re.compile(r"(?<![\w.])(\d+)(u?)\b")
KEPT = ("return", "break", "case")
"""Statements that are not dropped: without them nothing compiles, or nothing changes."""


def statement_changes(text: str) -> Iterator[tuple[int, str, str]]:
    """Yield the faults of C: line from 0 on, kind and changed line."""
    for number, line in enumerate(text.splitlines()):
        if line.startswith(" ") and "if (" in line and line.rstrip().endswith("{"):
            start = line.index("if (") + 4
            inside = line[start : line.rindex(")")]
            yield number, "condition inverted", f"{line[:start]}!({inside})) {{"
        if "FSM_HOOK" in line or "FSM_CHECKED" in line:  # nothing is compiled there
            continue
        declares = re.match(r" +(const |static |\w+ \w+( =|;))", line)
        if STATEMENT.match(line) and not declares:
            is_kept = line.strip().startswith(KEPT)
            if not is_kept and line.strip().startswith(("m->", "(*", "queue[", "timers[")):
                yield number, "store dropped", "    ;"
            elif not is_kept and re.match(r" +(\(void\))?\w+\(m", line):
                yield number, "call dropped", "    ;"
            if found := NUMBER.search(line):
                changed = (
                    f"{line[: found.start()]}{int(found[1]) + 1}{found[2]}{line[found.end() :]}"
                )
                yield number, "constant off by one", changed


def statement_faults(subject: Subject, count: int, random: Random) -> Totals:
    """Seed faults in the generated C, one at a time; only those that compile count."""
    covered = subject.executed_lines()
    possible = [
        (name, *change)
        for name in subject.program.sources
        for change in statement_changes(subject.program.files[name])
    ]
    random.shuffle(possible)
    totals, done = Totals(), 0
    for name, number, kind, changed in possible:
        if done == count:
            break
        lines = subject.program.files[name].splitlines()
        fault = Fault(f"{name}:{number + 1}: {lines[number].strip()}", kind)
        if number not in covered[name]:
            done += 1
            totals.never_executed.append(fault)
            continue
        text = "\n".join([*lines[:number], changed, *lines[number + 1 :]])
        try:
            differs = subject.differs({name: f"{text}\n"})
        except CompilationError:
            continue
        done += 1
        if differs:
            totals.found += 1
        elif differs is None:
            totals.equivalent.append(fault)
        else:
            totals.survived.append(fault)
    return totals
