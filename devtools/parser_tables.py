"""Write `fsmkit/language/grammar.json`, the tables of the parser, after a change of the grammar.

Lark numbers the states in an order that differs from run to run. Here they are in the order of a
search from the start, so that one grammar has one file.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from lark.grammar import Rule
from lark.lexer import TerminalDef

from fsmkit.language.parser_tables import GRAMMAR, TABLES, build_parser, fingerprint

SHIFT = 0


def tables_of(grammar: str) -> str:
    """Return the tables of a grammar as the text of a file of JSON."""
    data, memo = build_parser(grammar).memo_serialize([TerminalDef, Rule])
    data["parser"]["parser"] = _ordered(data["parser"]["parser"])
    content = {"made_by": fingerprint(grammar), "data": data, "memo": memo}
    return json.dumps(content, separators=(",", ":")) + "\n"


def _ordered(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Return tables with the tokens in order of name, the states in order of reach."""
    names = sorted(tables["tokens"].values())
    token_of = {name: number for number, name in enumerate(names)}
    actions = {
        state: sorted((token_of[tables["tokens"][token]], act) for token, act in row.items())
        for state, row in tables["states"].items()
    }
    reached = [state for _, state in sorted(tables["start_states"].items())]
    for state in reached:  # grows during the loop
        for _, (kind, next_state) in actions[state]:
            if kind == SHIFT and next_state not in reached:
                reached.append(next_state)
    number = {state: index for index, state in enumerate(reached)}
    return {
        "tokens": dict(enumerate(names)),
        "states": {
            number[state]: {
                token: [kind, number[to] if kind == SHIFT else to]
                for token, (kind, to) in actions[state]
            }
            for state in reached
        },
        "start_states": {name: number[s] for name, s in sorted(tables["start_states"].items())},
        "end_states": {name: number[s] for name, s in sorted(tables["end_states"].items())},
    }


if __name__ == "__main__":
    TABLES.write_text(tables_of(GRAMMAR.read_text(encoding="utf-8")), encoding="utf-8")
