"""What was probably meant: the help of a finding about an unknown name."""

from __future__ import annotations

from collections.abc import Iterable

from fsmkit.diagnostics.nearest import nearest


def suggest(name: str, known: Iterable[str], otherwise: str | None = None) -> str | None:
    """Return ``did you mean `...`?`` for the nearest known name, else ``otherwise``."""
    near = nearest(name, known)
    return f"did you mean `{near}`?" if near else otherwise
