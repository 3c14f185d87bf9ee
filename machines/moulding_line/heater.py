"""The controller of the heater: knows heater.dbc and python-can, and nothing of fsmkit's charts.

A body that is heated by its power and cools towards 20 degrees. It loses a share of the frames that
it sends and of those that come.
"""

from __future__ import annotations

import json
import random
import signal
import time
from pathlib import Path

import can
import cantools
import click

from fsmkit.carriers.can.translator import MulticastBus

DBC = Path(__file__).parents[1] / "heated_mould/heater.dbc"
CYCLE = 0.010
AMBIENT, GAIN, TIME_CONSTANT = 20.0, 4.0, 0.8
"""Degrees Celsius; degrees for each percent of power, at last; seconds."""
LIMIT = 300.0
"""Degrees Celsius, where a thermostat cuts the power."""


@click.command()
@click.argument("channel")
@click.option("--seconds", type=float, required=True, help="At most; until SIGTERM.")
@click.option("--loss", type=float, default=0.0)
@click.option("--seed", type=int, default=1)
def main(channel: str, seconds: float, loss: float, seed: int) -> None:
    """Run the heater on a bus, ``GROUP:PORT`` of UDP multicast."""
    messages = cantools.database.load_file(DBC)
    told, power = (messages.get_message_by_name(name) for name in ("heater", "set_power"))
    chance, percent, temperature, sent, dropped = random.Random(seed), 0, AMBIENT, 0, 0  # noqa: S311
    ended: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _: ended.append(number))
    with MulticastBus(channel) as bus:
        begin = due = time.monotonic()
        while due < begin + seconds and not ended:
            while (frame := bus.recv(max(0.0, due - time.monotonic()))) is not None:
                if frame.arbitration_id == power.frame_id and chance.random() >= loss:
                    percent = power.decode(frame.data)["percent"]
            goal = AMBIENT + GAIN * percent
            temperature = min(LIMIT, temperature + (goal - temperature) * CYCLE / TIME_CONSTANT)
            if chance.random() < loss:
                dropped += 1
            else:
                content = told.encode({"temperature": round(temperature, 1)})
                number = told.frame_id
                bus.send(can.Message(arbitration_id=number, data=content, is_extended_id=False))
                sent += 1
            due += CYCLE
    click.echo(json.dumps({"program": "heater", "sent": sent, "dropped": dropped}))


if __name__ == "__main__":
    main()
