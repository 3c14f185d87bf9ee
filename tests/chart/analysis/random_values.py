"""Random charts and systems through which values from outside go in all ways there are."""

from __future__ import annotations

from random import Random

RANGE = "-2..3"
CONSTANTS = ["-2", "-1", "0", "1", "2", "3", "4", "0.5"]


class _Writer:
    """Writes a chart over a few variables."""

    def __init__(self, random: Random) -> None:
        self.random = random
        variables = ["x", "level", "y", "list[1]", "seen", "measure()"]
        self.places = random.sample(variables, random.randrange(2, 4))

    def place(self, *, event: bool) -> str:
        return self.random.choice([*self.places, *(["event.v", "event.v"] if event else [])])

    def value(self, *, event: bool) -> str:
        """Return a value that is stored: mostly that of a place."""
        random, one, other = self.random, self.place(event=event), self.place(event=event)
        number = random.choice(["0", "1", "2"])
        kinds = [one] * 6 + [f"min({one}, 1)", f"max({one}, {other})", number]
        kinds += [f"({self.guard(event=event)} ? {one} : {number})"]
        return random.choice([*kinds, f"{one} + 1" if random.random() < 0.3 else one])

    def guard(self, *, event: bool) -> str:
        random, left = self.random, self.place(event=event)
        op = random.choice(["<", "<=", ">", ">=", "==", "!="])
        right = random.choice(CONSTANTS)
        if random.random() < 0.05:
            right = self.place(event=event)
        if random.random() < 0.1:
            left = f"min({left}, {self.place(event=event)})"
        return f"{right} {op} {left}" if random.random() < 0.5 else f"{left} {op} {right}"

    def deed(self, *, event: bool) -> str:
        value = self.value(event=event)
        written = [p for p in self.places if p not in ("seen", "measure()")] or ["level"]
        kinds = [f"{self.random.choice(written)} = {value}"] * 4
        kinds += [f"raise inner(v = {value})", f"send later(v = {value})"]
        kinds += [f"send out(v = {value})", f"tell({value})", f"log {value}"]
        kinds += ["for item in list { list[0] = item }"]
        return self.random.choice(kinds)

    def transition(self, *, event: bool) -> str:
        parts = [f"target: s{self.random.randrange(3)}"] if self.random.random() < 0.7 else []
        if self.random.random() < 0.7:
            parts.append(f'if: "{self.guard(event=event)}"')
        if self.random.random() < 0.8 or not parts:
            parts.append(f'do: "{self.deed(event=event)}"')
        return "{" + ", ".join(parts) + "}"


def random_chart(random: Random, name: str = "Chart") -> str:
    """Return a chart; it takes ``come`` and ``told``, and gives ``out``, ``tell`` and ``level``."""
    writer = _Writer(random)
    lines = [f"chart: {name}", "capacity: {queue: 2, internal: 2, delayed: 1, microsteps: 8}"]
    lines += [f'data: {{x: "{RANGE} = 0", y: "0..2 = 1", list: "{RANGE}[2]", item: "{RANGE} = 0"}}']
    lines += [f'inputs: {{seen: "{RANGE}"}}', f'outputs: {{level: "{RANGE} = 2"}}']
    lines += [f'operations: ["measure() -> {RANGE}", "tell(v {RANGE})"]']
    lines += ["events:", f'  in: ["come(v {RANGE})", "told(v {RANGE})"]']
    lines += [f'  internal: ["inner(v {RANGE})", "later(v {RANGE})"]']
    lines += [f'  out: ["out(v {RANGE})"]', "initial: s0", "states:"]
    for state in range(3):
        lines += [f"  s{state}:", "    rest: true"]
        if random.random() < 0.3:
            lines.append(f'    entry: "{writer.deed(event=False)}"')
        if state == 2:
            tested = random.choice(["x", "level"])
            lines.append(f'    invariant: "{tested} < {random.choice(CONSTANTS)}"')
        taken = random.sample(["come", "told", "inner", "later"], random.randrange(1, 4))
        lines.append("    on:")
        lines += [f"      {event}: {writer.transition(event=True)}" for event in taken]
        if state < 2 and random.random() < 0.3:
            test = writer.guard(event=False)
            lines.append(f'    always: {{if: "{test}", target: s{state + 1}}}')
        if random.random() < 0.3:
            lines.append(f"    after: {{10ms: {writer.transition(event=False)}}}")
    return "\n".join(lines) + "\n"


def random_files(seed: int, *, alone: bool) -> dict[str, str]:
    """Return the files of a chart alone, or of a system of two machines, the system first."""
    random = Random(seed)
    if alone:
        return {"chart": random_chart(random)}
    links = [
        "one.out -> two.told", "one.tell -> two.told", "one.level -> two.seen",
        "two.level -> one.seen", "two.out -> one.told", "one.out -> two.told: {kind: queued}",
    ]  # fmt: skip
    taken = random.sample(links, random.randrange(2, 4))
    if links[0] in taken and links[-1] in taken:
        taken.remove(links[-1])
    lines = ["system: Both", "machines: {one: one.yaml, two: two.yaml}", "connect:"]
    lines += [f"  - {f'{{{link}}}' if ': ' in link else link}" for link in taken]
    come = random.choice(["one.come", "one.come(v in -1..3)", "one.come"])
    free = [] if links[2] in taken else [random.choice(["two.seen", "two.seen in 0..3"])]
    may = ", ".join(f'"{item}"' for item in [come, *free])
    lines += ["environment:", f"  may: [{may}]", "properties:"]
    op = random.choice(["<", ">=", "=="])
    lines.append(f'  p: {{never: "one.In(s2) and two.level {op} {random.choice(CONSTANTS)}"}}')
    lines.append(f'  q: {{leads_to: [one.In(s1), "two.In(s1) or one.x {op} 1"]}}')
    lines.append(f'  r: {{reachable: "two.In(s2) and two.x {op} {random.choice(CONSTANTS)}"}}')
    return {
        "both": "\n".join(lines) + "\n",
        "one": random_chart(random, "One"),
        "two": random_chart(random, "Two"),
    }
