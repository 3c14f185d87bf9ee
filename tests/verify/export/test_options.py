"""Which steps share an option in Promela: those that do the same, and no others."""

from __future__ import annotations

from fsmkit.verify.export.network import Network
from fsmkit.verify.export.promela.options import options


def test_moves_share_an_option_where_they_do_the_same(supervisor: Network) -> None:
    (automaton,) = supervisor.automata
    found = options(automaton)
    moves = [move for option in found for move in option]
    assert sorted(map(repr, moves)) == sorted(map(repr, automaton.moves))
    assert len(found) < len(automaton.moves) / 2
    for option in found:
        deeds = {
            (m.action, m.taken, m.needs_empty, m.from_outside, m.sent, m.faults) for m in option
        }
        assert len(deeds) == 1
        stays = {move.target == move.source for move in option}
        assert len(stays) == 1
        assert stays == {True} or len({move.target for move in option}) == 1
