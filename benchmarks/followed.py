"""Measure following 10,000 steps per second, and seeking in a long session.

    python -m benchmarks.followed [--seconds 60] [--entries 1000000]

A source provides steps of a gate with unknown data, like a board that records only transitions. A
client in another process counts the WebSocket messages. Then a session is simulated and stepped
back. The output is the processor time of server and source, the messages of the client, and the
times of stepping back.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import multiprocessing
import resource
import tempfile
import time
from collections.abc import Mapping, Sequence
from multiprocessing.queues import Queue
from pathlib import Path

import msgspec
from msgspec.structs import replace
from websockets.sync.client import connect
from websockets.typing import Subprotocol

import fsmkit
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.server import LiveServer, serve_hub
from fsmkit.inspector.sources import Entry
from fsmkit.language import Value
from fsmkit.runtime.interpreter.snapshot import Occurrence
from fsmkit.runtime.live.messages import SUBPROTOCOL, Step
from fsmkit.system.of_one_chart import system_of

RATE = 10_000
"""Steps a second."""
LIMIT = 250_000_000
GATE = """\
chart: Gate
events: {in: [open, close]}
data: {n: 0..1000000 = 0}
initial: closed
states:
  closed: {on: {open: opened}, after: {10ms: {target: opened, do: "n = n < 1000000 ? n + 1 : 0"}}}
  opened: {on: {close: closed}, after: {10ms: closed}}
"""


def gate() -> fsmkit.Chart:
    """Return the chart of a gate."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "gate.yaml"
        path.write_text(GATE, encoding="utf-8")
        return fsmkit.read_chart(path)


class Board:
    """A gate that moves elsewhere, from the first client on."""

    time = "live"
    can: frozenset[str] = frozenset()
    begin = None

    def __init__(self, chart: fsmkit.Chart, seconds: int) -> None:
        self.system = system_of(chart)
        self.begun: float | None = None
        self.cpu = 0.0
        self.has_clients = False
        self._made, self._most = 0, seconds * RATE
        self._steps = tuple(
            Step(
                m=chart.name, n=0, at=0, cause=["event", event], on=[after],
                do=[["-", before], ["t", number], ["+", after]], timers=[(number + 1, 10)],
            )
            for number, event, before, after in (
                (0, "open", "closed", "opened"),
                (2, "close", "opened", "closed"),
            )
        )  # fmt: skip

    def receive(self) -> Sequence[Entry]:
        """Return the steps that are due."""
        if not self.has_clients:
            return ()
        cpu, now = time.process_time(), time.perf_counter()
        self.begun = now if self.begun is None else self.begun
        due = min(int((now - self.begun) * RATE), self._most)
        steps, first, self._made = self._steps, self._made, due
        found = [Entry(None, (replace(steps[n % 2], at=n // 10),), None) for n in range(first, due)]
        self.cpu += time.process_time() - cpu
        return found

    def post(self, machine: int, occurrence: Occurrence) -> None:
        """Reject the event: a board accepts no commands."""
        raise NotImplementedError

    def set_input(self, machine: int, place: int, value: Value) -> None:
        """Reject the input: a board accepts no commands."""
        raise NotImplementedError

    def signals(self) -> Mapping[str, float]:
        """Return nothing."""
        return {}

    def close(self) -> None:
        """Do nothing."""


class _Message(msgspec.Struct):
    k: str
    n: int = 0


def look_on(address: str, most: int, told: Queue[str]) -> None:
    """Count the received messages, in a process of its own."""
    decoder = msgspec.json.Decoder(list[_Message])
    steps = lost = last = frames = 0
    with connect(address, subprotocols=[Subprotocol(SUBPROTOCOL)], max_size=None) as client:
        while last < most:
            frames += 1
            for message in decoder.decode(client.recv(60)):
                steps += message.k == "step"
                lost += message.k == "lost"
                last = message.n if message.k == "step" else last
    told.put(f"client: {steps:,} of {most:,} steps in {frames:,} frames; told {lost} times of loss")


async def followed(seconds: int) -> None:
    """Serve a board to a client; print the cost."""
    board = Board(gate(), seconds)
    hub = Hub(board)
    server, stop = LiveServer(hub), asyncio.Event()
    spawning = multiprocessing.get_context("spawn")
    told: Queue[str] = spawning.Queue()

    def ready(_: str) -> None:
        address = f"ws://127.0.0.1:{server.port}/live?token={server.token}"
        spawning.Process(target=look_on, args=(address, seconds * RATE, told)).start()

    async def measure() -> None:
        while not hub.view.clients.numbers():
            await asyncio.sleep(0.05)
        board.has_clients = True
        cpu, wall = time.process_time(), time.perf_counter()
        await asyncio.sleep(seconds)
        cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
        print(
            f"server: {cpu / wall:.1%} of a core in {wall:.0f} s, the source {board.cpu / wall:.1%}"
        )
        print(await asyncio.to_thread(told.get))
        stop.set()

    await asyncio.gather(serve_hub(server, ready, stop=stop), measure())


def gone_back(entries: int) -> None:
    """Print how long it takes to look at other entries of a session."""
    hub = Hub(gate(), limit=LIMIT)
    client = hub.join(lambda _: None)

    def say(**command: object) -> float:
        begin = time.perf_counter()
        hub.receive(client, json.dumps({"id": 1, **command}))
        return (time.perf_counter() - begin) * 1000

    say(do="run", speed=0)
    while hub.n < entries:
        hub.advance(1)
    say(do="pause")
    print(f"back 1,000 of {hub.n:,}: {say(do='back', count=1000):.0f} ms")
    places = [say(do="seek", n=entries * part // 17 + 61) for part in range(17)]
    times = [say(do="seek", at=entries * 10 * part // 17) for part in range(17)]
    print(f"seek by number: at most {max(places):.0f} ms; by time: {max(times):.0f} ms")
    size = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    print(f"kept from entry {hub.view.history.first:,}; all of the process: {size} MB")


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--entries", type=int, default=1_000_000)
    given = parser.parse_args()
    asyncio.run(followed(given.seconds))
    gone_back(given.entries)


if __name__ == "__main__":
    main()
