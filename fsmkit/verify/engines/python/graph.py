"""Cycles and traps of a finite graph, for the oracle: ``graph[n]`` holds (successor, ordinal)."""

from __future__ import annotations

from collections.abc import Sequence

Graph = Sequence[Sequence[tuple[int, int]]]


def find_cycle(graph: Graph) -> tuple[int, tuple[int, ...]] | None:
    """Return a state on a cycle and the ordinals round it; None if there is no cycle."""
    grey, black = 1, 2
    colour = [0] * len(graph)
    for root in range(len(graph)):
        if colour[root]:
            continue
        colour[root] = grey
        stack = [(root, iter(graph[root]))]
        taken: list[int] = []
        while stack:
            state, edges = stack[-1]
            for to, ordinal in edges:
                if colour[to] == grey:
                    first = next(n for n, (on_path, _) in enumerate(stack) if on_path == to)
                    return to, (*taken[first:], ordinal)
                if not colour[to]:
                    colour[to] = grey
                    taken.append(ordinal)
                    stack.append((to, iter(graph[to])))
                    break
            else:
                colour[state] = black
                stack.pop()
                if taken:
                    taken.pop()
    return None


def find_traps(graph: Graph, shown: Sequence[object]) -> list[int]:
    """Return a state of each set that is never left and in which only one thing is ever shown.

    A state can get away if some path from it leads to where something else is shown; those that
    cannot are in traps, and so is all they lead to.
    """
    back: list[list[int]] = [[] for _ in graph]
    free = [False] * len(graph)
    for state, edges in enumerate(graph):
        for to, _ in edges:
            back[to].append(state)
            free[state] = free[state] or shown[to] != shown[state]
    waiting = [state for state, is_free in enumerate(free) if is_free]
    while waiting:
        for state in back[waiting.pop()]:
            if not free[state]:
                free[state] = True
                waiting.append(state)
    return [state for state, is_free in enumerate(free) if not is_free]
