"""Random charts whose data are often dead: written in handlers, read in few places."""

from __future__ import annotations

from random import Random

TARGETS = ["s0", "s1", "c", "c0", "c1", "back", "p", "r1"]
DOES = ["x = 0", "x = 1", "x = 2", "y = x", "x = y", "y = 1", "a[0] = x", "a[1] = 1", "y = a[0]",
        "z = 1", "z = x; x = 0", "x = 1; y = 0", "if x == 1 {y = 2} else {y = 0}",
        "if y == 1 {x = 2}", "send told(v = y)"]  # fmt: skip
GUARDS = ["x == 1", "x == 2", "y == 1", "y == 2", "a[0] == 1", "x < y", "z == 1"]


def random_chart_text(seed: int) -> str:
    """Return the text of a chart with a history, regions, entries, exits and timers."""
    random = Random(f"dead {seed}")
    # each chart has few of the texts, so that most variables are read in few places or nowhere
    does, guards = random.sample(DOES, 6), random.sample(GUARDS, 3)

    def handlers(indent: str) -> list[str]:
        return [
            f'{indent}{kind}: "{random.choice(does)}"'
            for kind in ("entry", "exit")
            if random.random() < 0.3
        ]

    def transition() -> str:
        parts = [f"target: {random.choice(TARGETS)}"] if random.random() < 0.8 else []
        if random.random() < 0.4:
            parts.append(f'if: "{random.choice(guards)}"')
        if random.random() < 0.5 or not parts:
            parts.append(f'do: "{random.choice(does)}"')
        return "{" + ", ".join(parts) + "}"

    def state(name: str, indent: str) -> list[str]:
        lines = [f"{indent}{name}:", f"{indent}  rest: {random.choice(['true', 'false'])}"]
        lines += handlers(indent + "  ")
        if random.random() < 0.2:
            lines.append(f"{indent}  defer: [e1]")
        events = [e for e in ("e0", "e1", "e2") if random.random() < 0.5]
        lines += [f"{indent}  on:"] if events else []
        lines += [f"{indent}    {event}: {transition()}" for event in events]
        if random.random() < 0.3:
            lines += [f"{indent}  after: {{10ms: {transition()}}}"]
        return lines

    lines = ["chart: Mortal", "capacity: {queue: 2, microsteps: 20}"]
    lines += ['data: {x: 0..2 = 0, y: 0..2 = 0, z: 0..1 = 0, a: "uint8[2] = 0"}']
    lines += ['events: {in: [e0, e1, e2], out: ["told(v 0..2)"]}', "initial: s0", "states:"]
    lines += [*state("s0", "  "), *state("s1", "  ")]
    lines += ["  c:", "    initial: c0", *handlers("    "), "    states:"]
    lines += [*state("c0", "      "), *state("c1", "      ")]
    lines += ["      back: {history: deep, default: c0}"]
    lines += ["  p:", *handlers("    "), "    regions:"]
    for region in "rt":
        lines += [f"      {region}:", f"        initial: {region}0", "        states:"]
        lines += [*state(f"{region}0", " " * 10), *state(f"{region}1", " " * 10)]
    lines += ["    on:", f"      e2: {transition()}"]
    return "\n".join(lines) + "\n"


SYSTEM = """
system: Mortals
machines: {one: chart.yaml, two: chart.yaml}
connect:
  - one.told -> two.e0
environment:
  may: [one.e0, two.e1]
  will: [one.e1, one.e2]
properties:
  seen: {never: "one.In(c1) and two.In(r1)"}
  read: {never: "two.z == 1 and one.In(s1)"}
  back: {leads_to: [one.In(s1), one.In(s0)]}
"""
