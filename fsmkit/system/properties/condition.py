"""Conditions over a system: a typed expression, and the meaning of its names."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.language import Expr


@dataclass(frozen=True, slots=True)
class Atom:
    """The meaning of a name in a condition: a state (``state``) or a variable of a machine.

    ``event``: whether the machine takes this event in the evaluated step.
    """

    machine: int
    state: int | None = None
    variable: str = ""
    event: int | None = None


@dataclass(frozen=True, slots=True)
class Condition:
    """A typed condition, and the meaning of its variables."""

    expression: Expr
    atoms: tuple[tuple[str, Atom], ...]
