"""``fsmkit new``: write a small file to start with."""

from __future__ import annotations

import keyword
import re
from collections.abc import Mapping
from pathlib import Path

import click

import fsmkit
from fsmkit.cli.common.console import out, print_json
from fsmkit.cli.common.options import OneOf
from fsmkit.cli.common.verbs import verb
from fsmkit.cli.common.writing import write_files
from fsmkit.diagnostics import fail
from fsmkit.editor.schemas import text_of

EPILOG = """\b
Examples:
  fsmkit new gate.yaml
  fsmkit new cell.system.yaml --like system
  fsmkit new --examples examples
"""
YAML = (".yaml", ".yml")
CHART = """\
chart: {name}
doc: A door that opens on request and closes automatically.

constants:
  T_OPEN: 3s

events:
  in: [request, obstacle]
  out: [opened, closed]

initial: shut

states:
  shut:
    on: {{request: open}}
  open:
    entry: send opened
    on: {{obstacle: open}}
    after:
      T_OPEN: {{target: shut, do: send closed}}
"""
PARALLEL = """\
chart: {name}
doc: A lamp and a fan that are switched independently of each other.

events:
  in: [lamp, fan]

initial: running

states:
  running:
    regions:
      lamp:
        initial: dark
        states:
          dark: {{on: {{lamp: bright}}}}
          bright: {{on: {{lamp: dark}}}}
      fan:
        initial: still
        states:
          still: {{on: {{fan: turning}}}}
          turning:
            on: {{fan: still}}
            after: {{10m: still}}
"""
DEVICE = """\
chart: {name}
doc: A device that is started, works, and reports when it is done or has failed.

types:
  Fault: [none, late]

constants:
  T_WORK: 2s

outputs:
  fault: Fault = none

operations:
  - motor(speed 0..100)

events:
  in: [start, arrived, reset]
  out: [done, failed]

initial: idle

states:
  idle:
    on: {{start: working}}
  working:
    entry: motor(100)
    exit: motor(0)
    on:
      arrived: {{target: idle, do: send done}}
    after:
      T_WORK: {{target: failed, do: fault = late}}
  failed:
    entry: send failed
    on:
      reset: {{target: idle, do: fault = none}}
"""
SYSTEM = """\
system: {name}
doc: A sender and a receiver, each of which is a chart of its own.

machines:
  sender: {stem}_sender.yaml
  receiver: {stem}_receiver.yaml

connect:
  - sender.item -> receiver.item
  - receiver.taken -> sender.taken

environment:
  may: [sender.go]

properties:
  in_step: {{never: sender.In(idle) and receiver.In(busy)}}
  arrives: {{reachable: receiver.In(busy)}}
"""
SENDER = """\
chart: {name}Sender

events:
  in: [go, taken]
  out: [item]

initial: idle

states:
  idle:
    rest: true
    on:
      go: {{target: waiting, do: send item}}
  waiting:
    on: {{taken: idle}}
"""
RECEIVER = """\
chart: {name}Receiver

events:
  in: [item]
  out: [taken]

initial: free

states:
  free:
    rest: true
    on: {{item: busy}}
  busy:
    after:
      100ms: {{target: free, do: send taken}}
"""
TEST = """\
tests: {name}
chart: {stem}.yaml

cases:
  opens and closes automatically:
    - post request
    - expect: {{in: open, sent: opened}}
    - wait 3s
    - expect: {{in: shut, sent: closed}}
  stays open while something is in the way:
    - post request; wait 2s; post obstacle; wait 2s
    - expect: {{in: open, not sent: closed}}
"""
LIKE: Mapping[str, tuple[str, Mapping[str, str]]] = {
    "chart": ("chart", {"{stem}{suffix}": CHART}),
    "device": ("chart", {"{stem}{suffix}": DEVICE}),
    "parallel": ("chart", {"{stem}{suffix}": PARALLEL}),
    "system": (
        "system",
        {
            "{stem}{suffix}": SYSTEM,
            "{stem}_sender.yaml": SENDER,
            "{stem}_receiver.yaml": RECEIVER,
        },
    ),
    "test": ("tests", {"{stem}{suffix}": TEST}),
}
"""For each model, the schema of its first file, and its files by name."""
PLAIN = re.compile(r"[^\W\d]\w*", re.ASCII)
EXAMPLES = Path(__file__).parents[1] / "examples"
TEST_SUFFIXES = (".test.yaml", ".test.yml")


@verb(EPILOG)
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--like",
    type=OneOf("model", sorted(LIKE)),
    default="chart",
    show_default=True,
    help="Choose what to write.",
)
@click.option(
    "--examples",
    is_flag=True,
    help="Write all examples of fsmkit into the new folder FILE.",
)
@click.option("--no-modeline", is_flag=True, help="Write no schema, and no line that names one.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def command(file: Path, like: str, examples: bool, no_modeline: bool, as_json: bool) -> int:
    """Create a small chart, system or test file.

    The file passes `fsmkit check` and `fsmkit test`. No file is overwritten. The schema for
    editors is written beside it.
    """
    _write(_examples(file) if examples else _model(file, like, no_modeline), as_json)
    return 0


def _examples(folder: Path) -> dict[Path, str]:
    """Return the text of each file of the examples, by its path below a folder."""
    return {
        folder / file.relative_to(EXAMPLES): file.read_text(encoding="utf-8")
        for file in sorted(EXAMPLES.rglob("*"))
        if file.is_file()
    }


def _model(file: Path, like: str, no_modeline: bool) -> dict[Path, str]:
    """Return the text of each file of a model, by its path."""
    if not file.name.lower().endswith(YAML):
        raise click.UsageError(f"`{file.name}` is not the name of a YAML file, such as `gate.yaml`")
    if like == "test" and not file.name.endswith(TEST_SUFFIXES):
        raise click.UsageError(f"the name of tests ends with `.test.yaml`, not `{file.suffix}`")
    stem = file.name.split(".", 1)[0]
    suffix = file.name[len(stem) :]
    name = _name(stem)
    kind, models = LIKE[like]
    made: dict[Path, str] = {}
    schemas: dict[Path, str] = {}
    for model, text in models.items():
        path = file.with_name(model.format(stem=stem, suffix=suffix))
        shown = kind if not made else "chart"
        schema = file.with_name(f"{shown}.schema.json")
        line = "" if no_modeline else f"# yaml-language-server: $schema={schema.name}\n"
        made[path] = line + text.format(name=name, stem=stem)
        if not (no_modeline or schema.exists()):
            schemas[schema] = text_of(shown, fsmkit.__version__)
    return made | schemas


def _write(made: Mapping[Path, str], as_json: bool) -> None:
    """Write files none of which exists, and print their paths."""
    for path in made:
        if path.exists():
            raise fail("unwritable-output", f"`{path}` exists already", help="choose another name")
    write_files(made)
    if as_json:
        print_json({"files": [str(path) for path in made]})
    else:
        for path in made:
            out.print(str(path), markup=False)


def _name(stem: str) -> str:
    """Return the name of a machine for the name of a file."""
    words = [word for word in re.split(r"[\W_]+", stem) if word]
    name = "".join(word[0].upper() + word[1:] for word in words)
    if not PLAIN.fullmatch(name) or keyword.iskeyword(name):
        raise click.UsageError(
            f"`{stem}` is not a machine name: start with a letter, as in `gate.yaml`"
        )
    return name
