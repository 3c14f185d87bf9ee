"""Edit files at random between requests: no request may fail or return stale results.

``python -m devtools.editor.fuzzing machines --edits 100000``

Each file of a folder is edited in turn: characters are deleted and inserted, words and lines
exchanged, pieces of other files pasted. After each edit, one or two features are requested at a
random position. At the end of a round the file has its original content, and the index must answer
like a new one. The folder is copied first, so that external changes do not matter. An interrupt
ends the campaign after the round, and prints the results.
"""

from __future__ import annotations

import argparse
import random
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from lsprotocol import types

from fsmkit.editor.analysis import Analyses
from fsmkit.editor.context import Context
from fsmkit.editor.features import (
    actions,
    completion,
    hover,
    lenses,
    navigation,
    outline,
    rename,
    tokens,
)
from fsmkit.editor.features.diagnostics import diagnostics_of
from fsmkit.editor.index.workspace import Workspace

PIECES = (
    *("{", "}", "[", "]", ": ", "- ", "'", '"', "\n", "\t", " ", "  ", "<", ">", "/>", "</", "&"),
    *("->", "super", "event.", "In(", "|\n", "#", "=", "==", "..", "*", "ä𝄞", "\u2028", "\r", "\0"),
)
ROUND = 60
"""Edits of a file before it has its text back."""
Ask = Callable[[Context, Path, types.Position], object]


def diagnose(context: Context, path: Path, _: types.Position) -> object:
    """Return the findings of a file, as they are published."""
    return diagnostics_of(context, context.analyses.analysis(path).findings, path)


def whole(_: Context) -> types.Range:
    """Return a range that holds any file."""
    return types.Range(types.Position(0, 0), types.Position(100_000, 0))


def rename_result(context: Context, path: Path, position: types.Position) -> object:
    """Return the edits of a renaming, or the reason of its rejection."""
    try:
        made = rename.renaming(context, path, position, "zz_fuzzed")
    except rename.RenameError as rejected:
        return str(rejected)
    return {p: len(spans) for p, spans in made.places.items()}


REQUESTS: dict[str, Ask] = {
    "completion": lambda c, p, at: completion.completion(c, p, at, snippets=True),
    "hover": hover.hover,
    "definition": navigation.definition,
    "declaration": navigation.declaration,
    "implementation": navigation.implementation,
    "references": lambda c, p, at: navigation.references(c, p, at, with_declaration=True),
    "highlights": navigation.highlights,
    "links": lambda c, p, _: navigation.links(c, p),
    "symbols": lambda c, p, _: outline.document_symbols(c, p),
    "folding": lambda c, p, _: outline.folding(c, p),
    "selection": lambda c, p, at: outline.selection(c, p, [at]),
    "tokens": lambda c, p, _: tokens.tokens(c, p),
    "lenses": lambda c, p, _: lenses.lenses(c, p),
    "hints": lambda c, p, _: lenses.hints(c, p, whole(c)),
    "actions": lambda c, p, _: actions.code_actions(c, p, whole(c), None, ()),
    "rename": rename_result,
    "diagnostics": diagnose,
}


def edited(text: str, chance: random.Random, pieces: list[str]) -> str:
    """Return a text with one edit."""
    at = chance.randrange(len(text) + 1)
    match chance.randrange(6):
        case 0:
            return text[:at] + text[at + 1 :]
        case 1:
            return text[:at] + text[at + chance.randrange(1, 40) :]
        case 2:
            return text[:at] + chance.choice(PIECES) + text[at:]
        case 3:
            return text[:at] + chance.choice(pieces) + text[at:]
        case 4:
            return text[:at] + chr(chance.randrange(32, 127)) + text[at:]
        case _:
            end = text.find("\n", at)
            return text if end < 0 else text[:at] + text[end:]


def answers(context: Context, path: Path) -> list[Any]:
    """Return the responses about a file that need no position, for comparison."""
    start = types.Position(0, 0)
    names = ("symbols", "tokens", "folding", "links", "diagnostics")
    return [REQUESTS[name](context, path, start) for name in names]


def fresh(folder: Path) -> Context:
    """Return an editor that has read nothing."""
    workspace = Workspace((folder,))
    return Context(workspace, Analyses(workspace))


def main() -> int:
    """Run the campaign; 1 where something raised or was stale."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--edits", type=int, default=10_000)
    parser.add_argument("--seconds", type=float, default=1e9)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="fsmkit-") as place:
        copy = Path(place, given.folder.resolve().name)
        shutil.copytree(given.folder, copy)
        return campaign(given, copy.resolve())


def campaign(given: argparse.Namespace, folder: Path) -> int:
    """Edit the files of a folder of our own; 1 where something raised or was stale."""
    chance = random.Random(given.seed)  # noqa: S311  (chance, not secrets)
    context = fresh(folder)
    paths = [file.path for file in context.workspace.files()]
    originals = {path: path.read_text(encoding="utf-8") for path in paths}
    pieces = [line for text in originals.values() for line in text.split("\n") if line.strip()]
    asked: Counter[str] = Counter()
    wrong: Counter[str] = Counter()
    edits, started = 0, time.monotonic()
    ended: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, _: ended.append(number))
    while edits < given.edits and time.monotonic() - started < given.seconds and not ended:
        path = chance.choice(paths)
        text = originals[path]
        for _ in range(min(ROUND, given.edits - edits)):
            text = edited(text, chance, pieces) or " "
            if chance.random() < 0.1:
                text = originals[path]
            context.workspace.set_text(path, text.encode("utf-8", "surrogatepass"))
            edits += 1
            lines = context.lines(path)
            for name in chance.sample(list(REQUESTS), 1 + (edits % 7 == 0)):
                if name in ("references", "rename", "lenses") and edits % 5:
                    name = "completion"  # noqa: PLW2901  (these features read all files)
                place = types.Position(0, 0)
                if lines is not None:
                    place = lines.position(chance.randrange(len(lines.text) + 1))
                asked[name] += 1
                try:
                    REQUESTS[name](context, path, place)
                except Exception:  # noqa: BLE001  (any exception is a failure)
                    last = traceback.format_exc()
                    key = f"{name}: {' | '.join(last.strip().splitlines()[-3:])}"
                    if key not in wrong:
                        kept = Path(f"fuzzed-{len(wrong)}{path.suffix}")
                        sys.stdout.write(f"{path} {place}\n{last}\n")
                        if given.seed >= 0:
                            kept.write_text(text, encoding="utf-8", errors="surrogatepass")
                    wrong[key] += 1
        context.workspace.set_text(path, originals[path].encode())
        if chance.random() < 0.1 and answers(context, path) != answers(fresh(folder), path):
            wrong[f"stale answers of {path.name}"] += 1
        context.workspace.set_text(path, None)
    sys.stdout.write(
        f"{edits} edits of {len(paths)} files, {sum(asked.values())} requests in "
        f"{time.monotonic() - started:.0f} s, {sum(wrong.values())} wrong\n"
    )
    for key, count in wrong.most_common():
        sys.stdout.write(f"{count} x {key}\n")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
