"""Put the statements of the base where a derived chart writes ``super``."""

from __future__ import annotations

from fsmkit.document.walk import mapped, parts
from fsmkit.language.statements.tree import Block, Super


def holds_super(block: Block) -> bool:
    """Whether ``super`` stands somewhere in these statements."""
    return any(isinstance(part, Super) for part in parts(block))


def insert_super(block: Block, base: Block) -> Block:
    """Return statements with those of the base where ``super`` stands."""
    inserted: Block = mapped(block, lambda part: base if isinstance(part, Super) else None)
    return inserted
