"""Random small systems: shared data, arrays, intervals, spontaneous steps, all kinds of links."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Mapping
from pathlib import Path
from random import Random

from fsmkit.diagnostics import Findings
from fsmkit.system.any_file import load_any
from fsmkit.system.system import System

GUARDS = ["a == {n}", "a != {n}", "b[{k}]", "not b[{k}]", "b[a]", "a < own", "own > {n}", "lit"]
DOES = ["a = {n}", "b[{k}] = not b[{k}]", "own += 1; a = own", "send out_{k}(v = a)", "b[a] = {t}",
        "own = 0", "a = (a + 1) % 3", "send out_{k}(v = own)", "lamp = not lamp"]  # fmt: skip
LINKS = ["", "", ": {kind: queued, capacity: 2}", ": {kind: queued, delay: 10ms, capacity: 2}",
         ": {kind: lossy}", ": {kind: lossy, capacity: 1}"]  # fmt: skip
MAY = ["[]", "[one.in_1]", '["m[i].in_1"]']
DELAYS = ["10ms", "20ms", "30ms", "0ms..20ms", "10ms..30ms", "10ms.."]


def random_system(seed: int) -> dict[str, str]:
    """Return the files of a system, the system first."""
    random = Random(seed)
    count = random.choice([1, 2, 2])
    lines = ["system: Random", "machines:"]
    lines.append(f'  "m[i in 0..{count - 1}]": {{chart: many.yaml, with: {{ME: i}}}}')
    lines += ["  one: one.yaml", 'shared: {a: 0..2 = 0, b: "bool[3] = false"}', "connect:"]
    lines.append(f"  - m[i].out_0 -> one.in_0{random.choice(LINKS)}")
    lines.append(f"  - one.out_1 -> m[{random.randrange(count)}].in_1{random.choice(LINKS)}")
    lines.append("  - one.lamp -> m[i].lit")
    if random.random() < 0.5:
        lines.append(f"  - m[i].out_1 -> m[(i + 1) % {count}].in_0{random.choice(LINKS)}")
    lines += ["environment:", f"  may: {random.choice(MAY)}"]
    lines += ['  will: ["m[i]", one]', "properties:"]
    lines.append('  p: {invariant: "count(i in m: m[i].In(s1)) < 2 or a == 0"}')
    lines.append('  q: {reachable: "one.In(s2) and any(k in 0..2: b[k])"}')
    charts = {name: _chart(random, name) for name in ("many", "one")}
    return {"system": "\n".join(lines) + "\n", **charts}


def random_deferring(seed: int) -> dict[str, str]:
    """Return a random system of which some states defer events, in queues of some length."""
    random = Random(f"deferring {seed}")
    files = random_system(seed)
    for name in ("many", "one"):
        queue = random.choice([2, 3, 4])
        text = files[name].replace("{queue: 2,", f"{{queue: {queue},")
        files[name] = _with_deferral(random, text, ["in_0", "in_1"])
    may = random.choice(["[one.in_0, one.in_1]", '["m[i].in_1", one.in_0]', '["m[i].in_0"]'])
    system = re.sub(r"  may: .*", f"  may: {may}", files["system"])
    will = random.choice(["[]", "[]", "[one]", '["m[i]"]'])  # those are of the environment
    system = re.sub(r"  will: .*", f"  will: {will}", system)
    for name, machine in (("many", "m[i]"), ("one", "one")):
        if machine not in will:
            text = re.sub(r"    sometimes: .*\n", "", files[name])
            files[name] = re.sub(r"\d+ms\.\.(\d+ms)", r"\1", text).replace("10ms..", "10ms")
    if random.random() < 0.8:  # else machines share data, so that their queues are no levels
        system = re.sub(r"shared: .*\n", "", system)
        system = system.replace("or a ==", "or one.a ==").replace(": b[k]", ": one.b[k]")
    return {**files, "system": system}


OF_SYSTEM = ["one.In(s{n})", "m[0].In(s{n})", "a == {n}", "b[{k}]", "one.In(s{n}) and a == {m}",
             "not one.In(s{n})", "m[0].In(s{n}) or b[{k}]", "one.own == {n}"]  # fmt: skip
OF_CHART = ["In(s{n})", "own == {n}", "not In(s{n})", "a == {n}"]
WILL = ["", '"m[i]"', "one", '"m[i]", one, one.in_1', '"m[i].in_0", one.in_0', '"m[i].in_1"',
        "one.in_0, one.in_1"]  # fmt: skip


def with_leads_to(files: Mapping[str, str], seed: int) -> dict[str, str]:
    """Return random files with random properties `leads_to`, and of a system with other events
    under `will`: random fairness.
    """
    random = Random(f"leads to {seed}")
    (first, text), *charts = files.items()
    has_machines = bool(charts)
    is_shared = "shared:" in text

    def condition() -> str:
        found = random.choice(OF_SYSTEM if has_machines else OF_CHART)
        for place in ("{n}", "{m}", "{k}"):
            found = found.replace(place, str(random.randrange(3)))
        if has_machines and not is_shared:
            found = re.sub(r"\ba ==", "one.a ==", re.sub(r"\bb\[", "one.b[", found))
        return found

    wanted = "".join(
        f'  L{n}: {{leads_to: ["{condition()}", "{condition()}"]}}\n' for n in range(4)
    )
    text = text.replace("properties:\n", f"properties:\n{wanted}")
    if not has_machines:
        return {first: text}
    will = random.choice(WILL)
    if will:
        text = re.sub(r"  will: .*", f"  will: [{will}]", text)
    texts = dict(charts)
    for chart, machine in (("many", '"m[i]"'), ("one", "one")):
        if will and machine not in will.split(", "):  # what only the environment may have
            texts[chart] = re.sub(r"    sometimes: .*\n", "", texts[chart])
            texts[chart] = re.sub(r"\d+ms\.\.(\d+ms)", r"\1", texts[chart])
            texts[chart] = texts[chart].replace("10ms..", "10ms")
    return {first: text, **texts}


def _with_deferral(random: Random, chart: str, events: list[str]) -> str:
    """Return a chart in which some states defer events."""

    def deferring(match: re.Match[str]) -> str:
        chosen = [event for event in events if random.random() < 0.45]
        return match[0] + (f"    defer: [{', '.join(chosen)}]\n" if chosen else "")

    return re.sub(r"^  s\d:\n", deferring, chart, flags=re.MULTILINE)


def random_open_chart(seed: int) -> dict[str, str]:
    """Return a random chart alone that defers events with payloads, and sends itself some."""
    random = Random(f"open {seed}")
    has_clock = random.random() < 0.4  # one timer at most
    later = [] if has_clock else ["send in_0(v = own) after 10ms"]
    text = _chart(random, "alone", [*DOES, *later, "own = event.v"])
    if has_clock:
        text = re.sub(r"^      40ms: .*\n", "", text, flags=re.MULTILINE)
        text = re.sub(r"\d+ms\.\.(\d+ms)", r"\1", text).replace("10ms..", "10ms")
    queue = random.choice([2, 3, 4])
    text = text.replace("{queue: 2,", f"{{queue: {queue},").replace("constants: {ME: 0}\n", "")
    text = _with_deferral(random, text, ["in_0", "in_1"])
    properties = ["p: {invariant: own < 2 or In(s0)}", "q: {reachable: own == 2 and In(s2)}"]
    properties += ["r: {never: 'b[1] and lit'}"] * (random.random() < 0.3)
    return {"alone": text + "properties:\n" + "".join(f"  {one}\n" for one in properties)}


def _chart(random: Random, name: str, does: list[str] = DOES) -> str:
    lines = [f"chart: {name.title()}", "constants: {ME: 0}", "capacity: {queue: 2, microsteps: 20}"]
    lines += ['data: {a: 0..2 = 0, b: "bool[3] = false", own: 0..2 = 0}', "inputs: {lit: bool}"]
    lines += ["outputs: {lamp: bool = false}"]
    lines += ["events:", '  in: ["in_0(v 0..2)", "in_1(v 0..2)"]']
    lines += ['  out: ["out_0(v 0..2)", "out_1(v 0..2)"]']
    lines += ["initial: s0", "states:"]
    for state in range(3):
        lines.append(f"  s{state}:")
        if random.random() < 0.6:
            lines.append("    rest: true")
        if random.random() < 0.3:
            lines.append(f"    entry: {_quoted(_text(random, DOES))}")  # here no event is at hand
        taken = [event for event in range(2) if random.random() < 0.7]
        lines += ["    on:"] if taken else []
        lines += [f"      in_{event}: {_transition(random, does)}" for event in taken]
        if state < 2 and random.random() < 0.4:
            guard = _quoted(_text(random, GUARDS))
            lines.append(f"    always: {{if: {guard}, target: s{state + 1}}}")
        if random.random() < 0.7:
            lines += ["    after:", f"      {random.choice(DELAYS)}: {_transition(random)}"]
            if random.random() < 0.3:
                lines.append(f"      40ms: {_transition(random)}")
        if random.random() < 0.4:
            lines.append(f"    sometimes: {_transition(random)}")
    return "\n".join(lines) + "\n"


def _transition(random: Random, does: list[str] = DOES) -> str:
    parts = [f"target: s{random.randrange(3)}"] if random.random() < 0.8 else []
    if random.random() < 0.5:
        parts.append(f"if: {_quoted(_text(random, GUARDS))}")
    if random.random() < 0.7 or not parts:
        parts.append(f"do: {_quoted(_text(random, does))}")
    return "{" + ", ".join(parts) + "}"


def _text(random: Random, texts: list[str]) -> str:
    text = random.choice(texts)
    text = text.replace("{t}", random.choice(["true", "false"]))
    text = text.replace("{n}", str(random.randrange(3)))
    return text.replace("{k}", str(random.randrange(2)))


def _quoted(text: str) -> str:
    return f'"{text}"'


def random_loop(seed: int) -> dict[str, str]:
    """Return a random system of which some machines run in a loop; delays of these are fixed."""
    random = Random(f"loop {seed}")
    files = random_system(seed)
    loop = random.choice([["one"], ["m[i]"], ["m[i]", "one"], ["one", "m[i]"]])
    around = [f'"{name}"' for name in ("m[i]", "one") if name not in loop]
    order = ", ".join(f'"{name}"' for name in loop)
    times = random.choice(["period: 20ms", "period: 20ms, jitter: 10ms", "period: 30ms"])
    system = re.sub(r"  will: .*", f"  will: [{', '.join(around)}]", files.pop("system"))
    system = system.replace("connect:", f"schedule: {{cyclic: [{order}], {times}}}\nconnect:")
    for chart, name in (("many", "m[i]"), ("one", "one")):
        if name in loop:
            files[chart] = re.sub(r"\d+ms\.\.(\d+ms)", r"\1", files[chart]).replace(
                "10ms..", "10ms"
            )
    return {"system": system, **files}


def random_freezing(seed: int) -> dict[str, str]:
    """Return a random system, in a loop or not, of which one or two nodes may freeze."""
    random = Random(f"freezing {seed}")
    files = random.choice([random_system, random_loop, random_deferring])(seed)
    system = files.pop("system")
    is_one = random.random() < 0.4
    nodes = (
        [["m[i]", "one"]] if is_one else random.choice([[["m[i]"]], [["one"]], [["m[i]"], ["one"]]])
    )
    if not is_one and "shared:" in system:
        system = re.sub(r"shared: .*\n", "", system)
        system = system.replace("or a ==", "or one.a ==").replace(": b[k]", ": one.b[k]")
    lines = ["  freezes:"]
    for number, node in enumerate(nodes):
        others = [name for name in ("m[i]", "one") if name not in node]
        parts = ["machines: [" + ", ".join(f'"{name}"' for name in node) + "]"]
        if others and random.random() < 0.8:
            within = random.choice(["10ms", "20ms", "10ms..20ms", "10ms..10ms"])
            parts += [f'silent: ["{others[0]}.lost"]', f"within: {within}"]
        if random.random() < 0.7:
            parts.append(f"continues: {random.choice(['10ms', '20ms', '30ms'])}")
        lines.append(f"    node{number}: {{{', '.join(parts)}}}")
    system = system.replace("environment:\n", "environment:\n" + "\n".join(lines) + "\n")
    condition = random.choice(["one.In(s1)", "one.own == 1", "m[0].In(s2)"])
    system += f'  r: {{reachable: "node0.In(stopped) and {condition}"}}\n'
    system += f'  s: {{invariant: "node0.In(running) or not {condition}"}}\n'
    for chart in ("many", "one"):
        text = files[chart].replace('"in_1(v 0..2)"]', '"in_1(v 0..2)", lost]')
        if any(("m[i]" if chart == "many" else "one") in node for node in nodes):
            text = re.sub(r"\d+ms\.\.(\d+ms)", r"\1", text).replace("10ms..", "10ms")
        files[chart] = re.sub(
            r"^    on:\n",
            lambda match: match[0] + f"      lost: {{target: s{random.randrange(3)}}}\n",
            text,
            flags=re.MULTILINE,
        )
    return {"system": system, **files}


KINDS = {"system": random_system, "deferring": random_deferring, "open": random_open_chart}
"""Makers of random files, by name."""


def load_files(files: Mapping[str, str]) -> System:
    """Load the first of some files."""
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder) / f"{name}.yaml" for name in files]
        for path, text in zip(paths, files.values(), strict=True):
            path.write_text(text, encoding="utf-8")
        return load_any(paths[0], Findings())
