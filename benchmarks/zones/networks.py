"""Timed automata of the literature, modelled by the charts under ``machines/``.

Constants and edges of CSMA/CD: Tripakis and Yovine 2001, with the step from `retry` to itself that
later authors added; FDDI: Daws, Olivero, Tripakis and Yovine 1996; the train gate: Yi, Pettersson
and Daniels 1994, as among UPPAAL's examples; Fischer's protocol as in UPPAAL's.
"""

from __future__ import annotations

from benchmarks.zones.search import Automaton, Data, Edge, Network, Test


def fischer(count: int, write: int = 2, wait: int = 3) -> Network:
    """Return Fischer's protocol; the data are whose turn it is."""

    def process(me: int) -> Automaton:
        def is_free(data: Data) -> bool:
            return data == (0,)

        def is_mine(data: Data) -> bool:
            return data == (me,)

        return Automaton(
            "idle",
            (
                Edge("idle", "wants", resets=(me,), when=is_free),
                Edge("wants", "waits", resets=(me,), do=lambda _: (me,)),
                Edge("waits", "wants", resets=(me,), when=is_free),
                Edge("waits", "critical", ((me, ">=", wait),), when=is_mine),
                Edge("critical", "idle", do=lambda _: (0,)),
            ),
            {"wants": ((me, "<=", write),)},
        )

    return Network(tuple(map(process, range(1, count + 1))), count, (0,))


def csma_cd(count: int, frame: int = 808, cable: int = 26) -> Network:
    """Return stations on a bus, which is clock 1; the data are the next stations of a collision."""
    twice = 2 * cable

    def hears(number: int) -> Edge:
        return Edge(
            "loop",
            "loop",
            channel=f"collision{number}!",
            when=lambda data: data == (number,),
            do=lambda data: (data[0] + 1,),
        )

    bus = Automaton(
        "idle",
        (
            Edge("idle", "active", resets=(1,), channel="begin?"),
            Edge("active", "collided", ((1, "<", cable),), (1,), "begin?"),
            Edge("active", "active", ((1, ">=", cable),), channel="busy!"),
            Edge("active", "idle", resets=(1,), channel="end?"),
            Edge("collided", "loop", ((1, "<", cable),)),
            *map(hears, range(count)),
            Edge("loop", "idle", resets=(1,), when=lambda d: d == (count,), do=lambda _: (0,)),
        ),
        {"collided": ((1, "<", cable),)},
        frozenset({"loop"}),
    )

    def station(number: int) -> Automaton:
        x, collision = number + 2, f"collision{number}?"
        early: tuple[Test, ...] = ((x, "<", twice),)
        return Automaton(
            "wait",
            (
                Edge("wait", "start", resets=(x,), channel="begin!"),
                Edge("wait", "retry", resets=(x,), channel="busy?"),
                Edge("wait", "wait", resets=(x,), channel=collision),
                Edge("wait", "retry", resets=(x,), channel=collision),
                Edge("start", "wait", ((x, ">=", frame), (x, "<=", frame)), (x,), "end!"),
                Edge("start", "retry", early, (x,), collision),
                Edge("retry", "start", early, (x,), "begin!"),
                Edge("retry", "retry", early, (x,), "busy?"),
                Edge("retry", "retry", early, (x,), collision),
            ),
            {"start": ((x, "<=", frame),), "retry": early},
        )

    return Network((bus, *map(station, range(count))), count + 1, (0,))


def fddi(count: int, sync: int = 20, delay: int = 0) -> Network:
    """Return a token ring; clock 1 is that of the token, each station has three."""
    target = 50 * count
    ring: list[Edge] = []
    for i in range(count):
        ring += [
            Edge(f"to{i}", f"at{i}", ((1, ">=", delay),), channel=f"take{i}!"),
            Edge(f"at{i}", f"to{(i + 1) % count}", resets=(1,), channel=f"give{i}?"),
        ]
    token = Automaton("to0", tuple(ring), {f"to{i}": ((1, "<=", delay),) for i in range(count)})

    def station(number: int) -> Automaton:
        since = 3 * number + 2
        edges: list[Edge] = []
        invariants: dict[str, tuple[Test, ...]] = {}
        take, give = f"take{number}?", f"give{number}!"
        for turn, other, mine, before in (
            ("a", "b", since + 2, since + 1),
            ("b", "a", since + 1, since + 2),
        ):
            full: tuple[Test, ...] = ((since, ">=", sync),)
            edges += [
                Edge(turn, turn + "last", ((since, ">=", target),), (since, mine), take),
                Edge(turn, turn + "first", ((since, "<", target),), (since, mine), take),
                Edge(turn + "last", other, full, channel=give),
                Edge(turn + "first", turn + "extra", full),
                Edge(turn + "extra", other, channel=give),
            ]
            invariants[turn + "last"] = invariants[turn + "first"] = ((since, "<=", sync),)
            invariants[turn + "extra"] = ((before, "<=", target + sync),)
        return Automaton("a", tuple(edges), invariants)

    return Network((token, *map(station, range(count))), 3 * count + 1)


def train_gate(count: int) -> Network:
    """Return trains and a gate; the data are the crossing and waiting trains, in order."""

    def of_train(i: int) -> tuple[Edge, ...]:
        def joined(data: Data) -> Data:
            return (*data, i)

        def is_first(data: Data) -> bool:
            return data[:1] == (i,)

        def is_last(data: Data) -> bool:
            return data[-1:] == (i,)

        return (
            Edge("free", "taken", channel=f"near{i}?", when=lambda data: not data, do=joined),
            Edge("free", "taken", channel=f"go{i}!", when=is_first),
            Edge("taken", "stopping", channel=f"near{i}?", do=joined),
            Edge("stopping", "taken", channel=f"stop{i}!", when=is_last),
            Edge("taken", "free", channel=f"left{i}?", when=is_first, do=lambda data: data[1:]),
        )

    edges = tuple(edge for i in range(count) for edge in of_train(i))
    gate = Automaton("free", edges, committed=frozenset({"stopping"}))

    def train(number: int) -> Automaton:
        x = number + 1
        return Automaton(
            "far",
            (
                Edge("far", "near", resets=(x,), channel=f"near{number}!"),
                Edge("near", "crossing", ((x, ">=", 10),), (x,)),
                Edge("near", "stopped", ((x, "<=", 10),), channel=f"stop{number}?"),
                Edge("stopped", "starting", resets=(x,), channel=f"go{number}?"),
                Edge("starting", "crossing", ((x, ">=", 7),), (x,)),
                Edge("crossing", "far", ((x, ">=", 3),), channel=f"left{number}!"),
            ),
            {
                "near": ((x, "<=", 20),),
                "starting": ((x, "<=", 15),),
                "crossing": ((x, "<=", 5),),
            },
        )

    return Network((gate, *map(train, range(count))), count)
