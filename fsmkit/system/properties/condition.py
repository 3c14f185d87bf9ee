"""Conditions over a system: a typed expression, and what its names stand for."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.language import Expr


@dataclass(frozen=True, slots=True)
class Atom:
    """What a name in a condition means: a state (``state``) or a variable of a machine.

    ``event``: whether the machine takes this event in the step that is evaluated.
    """

    machine: int
    state: int | None = None
    variable: str = ""
    event: int | None = None


@dataclass(frozen=True, slots=True)
class Condition:
    """A condition, typed, and what its variables stand for."""

    expression: Expr
    atoms: tuple[tuple[str, Atom], ...]
