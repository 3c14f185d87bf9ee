"""The table of the functions that handle events."""

from __future__ import annotations

from collections.abc import Sequence

from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.names import Names


def print_answers(
    out: Unit,
    names: Names,
    what: str,
    rows: Sequence[tuple[str, str]],
    index: str,
    otherwise: str,
) -> None:
    """Print the table and its look-up.

    ``rows``: functions, each with a comment; ``index``: an expression for the row; ``otherwise``:
    the function for an index without a row, whatever bytes the machine and the event hold. The
    handler is called last, so compilers jump to it, and it returns directly to the host.
    """
    p = names.own
    out.define("answer_function")
    out.line(f"typedef fsm_result {p}_answer_function({p} *m, const {p}_event *cause);")
    out.line()
    out.define("answer_table")
    out.line(f"/* {what} */")
    with out.block(f"static {p}_answer_function *const {p}_answer_table[{len(rows)}] = {{", "};"):
        for name, note in rows:
            out.line(f"{name}, {names.remark(note)}")
    out.line()
    out.define("respond")
    out.line(f"static fsm_result {p}_respond({p} *m, const {p}_event *cause)")
    with out.block("{"):
        out.line(f"return {index} < {len(rows)}u")
        out.line(f"    ? {p}_answer_table[{index}](m, cause)")
        out.line(f"    : {p}_{otherwise}(m, cause);")
    out.line()
