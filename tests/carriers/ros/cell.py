"""A camera and a belt in fsmkit, a lens in ROS: every kind of value crosses between them."""

from __future__ import annotations

from pathlib import Path

FILES = {
    "cell": """\
system: Cell
machines: {camera: camera.yaml, belt: belt.yaml, lens: lens.yaml}
connect:
  - lens.judged -> camera.judged
  - camera.look -> lens.look
  - lens.light -> camera.light
  - lens.is_sharp -> camera.is_sharp
  - belt.position -> lens.encoder
  - belt.pause -> lens.pause
environment: {will: [lens]}
""",
    "camera": """\
chart: Camera
types: {Verdict: [good, bad_2]}
data: {seen: 0..255 = 0, last: Verdict = Verdict.good}
inputs: {light: 0..1000, is_sharp: bool}
events: {in: ["judged(verdict Verdict, quality 0..255)"], out: [look(near bool)]}
initial: waiting
states:
  waiting:
    on: {judged: {do: "seen = event.quality; last = event.verdict; send look(near = true)"}}
""",
    "belt": """\
chart: Belt
outputs: {position: -100000..100000 = 0, pause: duration = 10ms}
initial: moving
states: {moving: {}}
""",
    "lens": """\
chart: Lens
types: {Verdict: [good, bad_2]}
outputs: {light: 0..1000 = 0, is_sharp: bool = true}
inputs: {encoder: -100000..100000, pause: duration}
events:
  in: [look(near bool)]
  out: ["judged(quality 0..255, verdict Verdict, took duration, ratio float32)"]
initial: seeing
states:
  seeing:
    on:
      look: {do: "send judged(quality = 7, verdict = Verdict.good, took = 5ms, ratio = 0.5)"}
""",
}
DEPLOYMENT = """\
system: cell.yaml
nodes:
  b: [camera, belt]
  vision: {machines: [lens], foreign: ros}
links:
  foreign:
    vision:
        domain: 7
        namespace: /cell
"""


def written(folder: Path, **changes: str) -> Path:
    """Write the deployment and its files, with changes; return its path."""
    for name, content in (FILES | {"deployment": DEPLOYMENT} | changes).items():
        (folder / f"{name}.yaml").write_text(content, encoding="utf-8")
    return folder / "deployment.yaml"
