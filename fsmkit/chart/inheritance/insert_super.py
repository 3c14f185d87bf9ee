"""Put the statements of the base where a derived chart writes ``super``."""

from __future__ import annotations

from dataclasses import replace

from fsmkit.language.statements.tree import Block, DocForEach, DocIf, DocStatement, DocSuper


def holds_super(block: Block) -> bool:
    """Whether ``super`` stands somewhere in these statements."""
    return any(isinstance(s, DocSuper) or any(map(holds_super, _bodies(s))) for s in block)


def _bodies(statement: DocStatement) -> tuple[Block, ...]:
    match statement:
        case DocIf(branches):
            return tuple(branch.body for branch in branches)
        case DocForEach(body=body):
            return (body,)
        case _:
            return ()


def insert_super(block: Block, base: Block) -> Block:
    """Return statements with those of the base where ``super`` stands."""
    result: list[DocStatement] = []
    for statement in block:
        match statement:
            case DocSuper():
                result += base
            case DocIf(branches):
                changed = tuple(replace(b, body=insert_super(b.body, base)) for b in branches)
                result.append(replace(statement, branches=changed))
            case DocForEach(body=body):
                result.append(replace(statement, body=insert_super(body, base)))
            case _:
                result.append(statement)
    return tuple(result)
