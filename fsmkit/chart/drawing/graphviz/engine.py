"""Run Graphviz: its program ``dot`` if it is installed, the bundled WebAssembly otherwise.

Both read the same text and write the same formats, so the style of drawings has one source. The
WebAssembly has no fonts and no bitmaps: it estimates the widths of texts, and draws SVG only.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from typing import Literal

from fsmkit.chart.drawing.graphviz import bundled
from fsmkit.diagnostics import FsmkitError, fail

Layout = Literal["dot", "neato -n2"]
"""How nodes are placed: by ``dot``, or where their attributes say."""
BITMAPS = ("png", "pdf")
"""Formats that only the program draws."""


def run_graphviz(
    text: str,
    formats: Sequence[str],
    layout: Layout = "dot",
    seconds: float | None = None,
    *,
    is_small: bool = False,
) -> bytes:
    """Return the output of Graphviz in several formats, one after the other.

    Args:
        text: A graph in the language of Graphviz.
        formats: For instance ``svg`` and ``json``.
        layout: How nodes are placed.
        seconds: Stop after this much time.
        is_small: Prefer the bundled Graphviz, which is loaded already: a program takes longer to
            start than a small graph takes to be drawn.

    Raises:
        FsmkitError: ``missing-graphviz``, ``drawing-failed``.

    """
    is_bundled = is_small and bundled.missing_part() is None
    if not is_bundled and shutil.which("dot") is not None:
        return _run_program(text, formats, layout, seconds)
    if any(kind in BITMAPS for kind in formats):
        raise fail(
            "missing-graphviz",
            f"a {formats[0].upper()} needs Graphviz's `dot`, which is not installed",
            help="draw `.svg`, or install Graphviz: `apt install graphviz`, `brew install graphviz`"
            ", `winget install graphviz`",
        )
    if (missing := bundled.missing_part()) is not None:
        raise fail(
            "missing-graphviz",
            f"drawings need Graphviz: `dot` is not installed, and {missing}",
            help="install Graphviz (`apt install graphviz`, `brew install graphviz`, `winget "
            "install graphviz`), or draw `.mmd`, `.puml` or `.dot`",
        )
    try:
        return bundled.run(text, formats, layout, seconds)
    except bundled.GraphvizError as error:
        raise _failed("the bundled Graphviz", str(error)) from error


def why_no_drawing() -> str | None:
    """Return why no SVG can be drawn on this machine, in a sentence; None if it can be."""
    if shutil.which("dot") is not None or (missing := bundled.missing_part()) is None:
        return None
    return f"Graphviz's `dot` is not installed, and {missing}. Install Graphviz to see a drawing."


def _run_program(text: str, formats: Sequence[str], layout: Layout, seconds: float | None) -> bytes:
    import graphviz

    engine, *options = layout.split()
    command = [engine, *options, *(f"-T{kind}" for kind in formats)]
    try:
        if len(formats) == 1 and seconds is None:
            source = graphviz.Source(text, engine=engine)
            is_placed = bool(options)
            return bytes(source.pipe(format=formats[0], neato_no_op=2 * is_placed, quiet=True))
        # several formats of one layout, which the package does not have
        done = subprocess.run(
            command, input=text.encode(), capture_output=True, check=True, timeout=seconds
        )
    except (subprocess.SubprocessError, OSError) as error:
        message = (getattr(error, "stderr", None) or b"").decode(errors="replace").strip()
        raise _failed(f"`{engine}`", message.splitlines()[0] if message else error) from error
    return done.stdout


def _failed(engine: str, reason: object) -> FsmkitError:
    return fail(
        "drawing-failed",
        f"{engine} did not draw it: {reason}",
        help="fold states with `--fold`, or draw `.dot` and look at it",
    )
