"""Two machines that send each other numbers; either can be in ROS."""

from __future__ import annotations

from pathlib import Path

CHART = """\
chart: {name}
events: {{in: ["{heard}(number 0..65535)"], out: ["{said}(number 0..65535)"]}}
initial: running
states:
  running:
    on: {{{heard}: {{do: "send {said}(number = event.number)"}}}}
"""
SYSTEM = """\
system: {name}
machines: {{camera: camera.yaml, lens: lens.yaml}}
connect:
  - lens.judged -> camera.judged
  - camera.look -> lens.look
environment: {{will: [{foreign}]}}
"""
DEPLOYMENT = """\
system: {name}.yaml
nodes:
  b: [{own}]
  other: {{machines: [{foreign}], foreign: ros}}
links:
  foreign:
    other:
      domain: {domain}
      insecure: {insecure}
      bind:
        lens.judged -> camera.judged: {{topic: /judged, type: std_msgs/msg/UInt32}}
        camera.look -> lens.look: {{topic: /look, type: std_msgs/msg/UInt32}}
"""
BETWEEN = """\
system: ping.yaml
nodes: {{a: [camera], b: [lens]}}
links: {{kind: ros, domain: {domain}, namespace: /cell}}
"""


def between(folder: Path, domain: int) -> Path:
    """Write the deployment in which both machines are nodes of fsmkit; return its path."""
    path = counting(folder, domain, "camera")
    system = (folder / "ping.yaml").read_text(encoding="utf-8")
    (folder / "ping.yaml").write_text(
        system.replace("environment: {will: [lens]}\n", ""), encoding="utf-8"
    )
    path.write_text(BETWEEN.format(domain=domain), encoding="utf-8")
    return path


def counting(folder: Path, domain: int, own: str, *, is_insecure: bool = False) -> Path:
    """Write the deployment in which one of the machines is not in ROS; return its path."""
    folder.mkdir(exist_ok=True)
    foreign = "lens" if own == "camera" else "camera"
    name = "ping" if own == "camera" else "pong"
    files = {
        "camera": CHART.format(name="Camera", heard="judged", said="look"),
        "lens": CHART.format(name="Lens", heard="look", said="judged"),
        name: SYSTEM.format(name=name, foreign=foreign),
        "deployment": DEPLOYMENT.format(
            name=name,
            own=own,
            foreign=foreign,
            domain=domain,
            insecure=str(is_insecure).lower(),
        ),
    }
    for each, content in files.items():
        (folder / f"{each}.yaml").write_text(content, encoding="utf-8")
    return folder / "deployment.yaml"
