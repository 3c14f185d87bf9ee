"""Measure the response times of the language server: 95th percentiles, against the goals.

``python benchmarks/editor.py`` starts the server over standard input and output, types into charts
of the production cell and into a chart of 3,000 lines, and times the responses.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from lsprotocol import types

from fsmkit.editor.context import uri_of

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from tests.editor.client import Editor  # noqa: E402  (the client of the tests)

AIMS = {
    "start, s": 1.5,
    "start, user s": 1.5,
    "memory, MB": 150,
    "completion, ms": 50,
    "hover, ms": 30,
    "definition, ms": 30,
    "diagnostics after the last key, ms": 200,
    "rename in all files, s": 1.0,
    "diagnostics of 3,000 lines, s": 1.0,
    "picture after an edit, ms": 150,
}
"""A preview waits 150 ms for the next key, and is to follow an edit within 300."""


def percentile(times: list[float]) -> float:
    """Return the 95th percentile."""
    return sorted(times)[min(len(times) - 1, int(len(times) * 0.95))]


def timed(count: int, act: Callable[[int], object]) -> list[float]:
    """Return the duration of each call in seconds."""
    found = []
    for number in range(count):
        began = time.perf_counter()
        act(number)
        found.append(time.perf_counter() - began)
    return found


def large(lines: int) -> str:
    """Return a chart of about so many lines."""
    states = [
        f"  s{n}:\n    entry: count = {n % 9}\n    on:\n"
        f"      go: {{target: s{(n + 1) % (lines // 5)}}}\n"
        f"      back: {{if: count > {n % 9}, target: s{max(0, n - 1)}}}"
        for n in range(lines // 5)
    ]
    head = "chart: Large\nevents: {in: [go, back]}\ndata: {count: 0..9 = 0}\ninitial: s0\nstates:\n"
    return head + "\n".join(states) + "\n"


def memory(editor: Editor) -> float:
    """Return the server's memory in MB; 0 if the system does not report it."""
    process = editor.client._server  # noqa: SLF001  (pygls tells it nowhere else)
    if process is None:
        return 0.0
    try:
        status = Path(f"/proc/{process.pid}/status").read_text(encoding="ascii")
    except OSError:
        return 0.0
    line = next(line for line in status.splitlines() if line.startswith("VmRSS"))
    return int(line.split()[1]) / 1024


def user_seconds(editor: Editor) -> float:
    """Return the server's processor time; 0 if the system does not report it."""
    process = editor.client._server  # noqa: SLF001  (pygls tells it nowhere else)
    try:
        fields = Path(f"/proc/{process.pid if process else 0}/stat").read_text(encoding="ascii")
    except OSError:
        return 0.0
    return int(fields.rpartition(")")[2].split()[11]) / os.sysconf("SC_CLK_TCK")


def run(count: int) -> dict[str, float]:
    """Return the figures."""
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made).resolve() / "cell"
        shutil.copytree(ROOT / "machines" / "production_cell", folder)
        began = time.perf_counter()
        editor = Editor(folder)
        found = {"start, s": time.perf_counter() - began, "start, user s": user_seconds(editor)}
        path = folder / "feeder.yaml"
        text = path.read_text(encoding="utf-8")
        editor.open(path)
        editor.ask(  # all files are read once
            editor.client.workspace_symbol_async, types.WorkspaceSymbolParams("feeder")
        )

        def complete(number: int) -> None:
            typed = text.replace("target: retracting", f"target: {'retract'[: number % 8]}¦", 1)
            place = typed.index("¦")
            typed = typed.replace("¦", "")
            editor.change(path, typed)
            where = editor.lines(path).position(place)
            params = types.CompletionParams(types.TextDocumentIdentifier(uri_of(path)), where)
            editor.ask(editor.client.text_document_completion_async, params)

        found["completion, ms"] = 1000 * percentile(timed(count, complete))
        found["diagnostics after the last key, ms"] = 1000 * percentile(
            timed(
                max(5, count // 4),
                lambda n: editor.open(path, text.replace("initial: at_home", f"initial: x{n}", 1)),
            )
        )

        def draw(number: int) -> None:
            editor.change(path, text.replace("initial: at_home", f"initial: at_home # {number}"))
            send = editor.client.protocol.send_request_async
            asked = {"uri": uri_of(path), "folded": [], "active": []}
            editor.ask(lambda params: send("fsmkit/draw", params), asked)

        found["picture after an edit, ms"] = 1000 * percentile(timed(max(5, count // 10), draw))
        editor.open(path, text)
        at = editor.at(path, "goto(HOME")
        hover = types.HoverParams(**at)
        ask = editor.client.text_document_hover_async
        found["hover, ms"] = 1000 * percentile(timed(count, lambda _: editor.ask(ask, hover)))
        definition = types.DefinitionParams(**at)
        go = editor.client.text_document_definition_async
        found["definition, ms"] = 1000 * percentile(
            timed(count, lambda _: editor.ask(go, definition))
        )
        name = types.RenameParams(new_name="zz_renamed", **editor.at(path, "operational:"))
        rename = editor.client.text_document_rename_async
        found["rename in all files, s"] = percentile(
            timed(max(3, count // 10), lambda _: editor.ask(rename, name))
        )
        found["memory, MB"] = memory(editor)
        wide = folder / "large.yaml"
        content = large(3000)
        wide.write_text(content, encoding="utf-8")
        editor.open(wide)
        found["diagnostics of 3,000 lines, s"] = percentile(
            timed(5, lambda n: editor.open(wide, content.replace("s5}", f"s{n + 6}}}", 1)))
        )
        editor.close()
    return found


def main() -> int:
    """Print the figures; 1 where an aim is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    found = run(given.count)
    if given.json:
        print(json.dumps(found, indent=1))
    else:
        for name, aim in AIMS.items():
            mark = "" if found[name] <= aim else "  MISSED"
            print(f"{name:40} {found[name]:10.2f}   aim {aim:g}{mark}")
    return int(any(found[name] > aim for name, aim in AIMS.items()))


if __name__ == "__main__":
    sys.exit(main())
