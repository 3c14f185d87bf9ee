"""Draws a recorded run: positions of the axes, states of the modules, and where the blocks are."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np
import numpy.typing as npt

from .observed import starts
from .recording import Recording
from .signals import AXES, SLOTS

ROUND = ("feeder_belt", "extraction_belt")
"""Belts go on for ever: drawn is the way since a slot."""
GREY, BLUE, RED, INK = "#b9bec5", "#2a6f97", "#c0392b", "#22303c"
FAILED = {"error", "faulted", "latched", "wait_reset", "falling", "fallen"}
WAITING = {
    "idle", "at_home", "waiting_for_block", "waiting_for_place", "pulled_back", "searching",
    "empty", "ready", "opened", "unhomed", "unpowered",
}  # fmt: skip
PALETTE = ("#2a6f97", "#e08e45", "#5b8c5a", "#8d5a97", "#b5893c", "#4f6d7a", "#a23b72", "#3f7d20")


def draw(recording: Recording, path: Path, begin: float, end: float) -> None:
    """Draw a part of a recording, times in s, as SVG or PNG.

    Raises ImportError without Matplotlib.
    """
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    rows = slice(int(begin * 1000), min(int(end * 1000), len(recording)))
    time = np.arange(rows.start, rows.stop) / 1000
    figure, parts = plt.subplots(
        3,
        1,
        figsize=(14, 12),
        sharex=True,
        height_ratios=(len(AXES) + 1, 9, 4),
        layout="constrained",
    )
    _axes(parts[0], recording, rows, time)
    _states(parts[1], recording, rows)
    _blocks(parts[2], recording, rows)
    parts[2].set_xlabel("simulated time in s")
    parts[0].set_xlim(begin, rows.stop / 1000)
    for part in parts:
        part.spines[["top", "right"]].set_visible(False)
        part.tick_params(length=0)
        part.grid(axis="x", color="#e4e7ea", linewidth=0.6)
        part.set_axisbelow(True)
    figure.savefig(path)
    plt.close(figure)


def _axes(part, recording: Recording, rows: slice, time: npt.NDArray[np.float64]) -> None:  # type: ignore[no-untyped-def]
    """Draw the positions, one above the other, each over its own range."""
    lanes = [*AXES, "sorter"]
    for lane, axis in enumerate(reversed(lanes)):
        position = recording[f"{axis}.position"][rows].astype(float)
        if axis in ROUND:
            position = (position + 500) % 1000 - 500
            position[:-1][np.abs(np.diff(position)) > 500] = np.nan
        low, high = np.nanmin(position), np.nanmax(position)
        part.plot(
            time, lane + 0.8 * (position - low) / max(high - low, 1.0), color=BLUE, linewidth=1
        )
        part.text(
            1.005,
            lane + 0.8,
            f"{high:.0f}",
            transform=part.get_yaxis_transform(),
            size=7,
            va="center",
            color=INK,
        )
        part.text(
            1.005,
            lane,
            f"{low:.0f}",
            transform=part.get_yaxis_transform(),
            size=7,
            va="center",
            color=INK,
        )
    part.set_yticks(
        [lane + 0.4 for lane in range(len(lanes))],
        [name.replace("_", " ") for name in reversed(lanes)],
    )
    part.set_ylim(-0.2, len(lanes))
    part.set_title(
        "positions (counts; belts: from the slot; sorter: thousandths)", loc="left", size=10
    )


def _states(part, recording: Recording, rows: slice) -> None:  # type: ignore[no-untyped-def]
    """Draw the states of the modules as bars, named where there is room."""
    states = recording.about["states"]
    modules = [name for name in reversed(tuple(states)) if f"{name}.state" in recording]
    width = (rows.stop - rows.start) / 1000
    for lane, module in enumerate(modules):
        column = recording[f"{module}.state"][rows]
        begins = starts(column).tolist()
        for begin, end in zip(begins, [*begins[1:], len(column)], strict=True):
            name = states[module][int(column[begin])]
            left, length = (rows.start + begin) / 1000, (end - begin) / 1000
            part.barh(
                lane,
                length,
                left=left,
                height=0.72,
                color=_shade(name),
                edgecolor="white",
                linewidth=0.4,
            )
            if length > width * 0.0062 * len(name):
                part.text(
                    left + length / 2,
                    lane,
                    name.replace("_", " "),
                    ha="center",
                    va="center",
                    size=6.5,
                    color="white" if name in FAILED else INK,
                )
    part.set_yticks(range(len(modules)), [name.replace("_", " ") for name in modules])
    part.set_ylim(-0.6, len(modules) - 0.4)
    part.set_title("states", loc="left", size=10)


def _shade(name: str) -> str:
    """Return the colour of a state: the same in all modules; grey where nothing is done."""
    if name in FAILED:
        return RED
    if name in WAITING:
        return "#e8ebee"
    shades = (
        "#b7d3e4",
        "#f3d3b0",
        "#c4dcc3",
        "#d9c4de",
        "#ecdcb6",
        "#c3d0d6",
        "#e6bcd2",
        "#cfe3c0",
    )
    return shades[zlib.crc32(name.encode()) % len(shades)]


def _blocks(part, recording: Recording, rows: slice) -> None:  # type: ignore[no-untyped-def]
    """Draw in which slot each block is."""
    for lane, slot in enumerate(reversed(SLOTS)):
        column = recording[f"slot.{slot}"][rows]
        begins = starts(column).tolist()
        for begin, end in zip(begins, [*begins[1:], len(column)], strict=True):
            block = int(column[begin])
            if block:
                left, length = (rows.start + begin) / 1000, (end - begin) / 1000
                part.barh(lane, length, left=left, height=0.9, color=PALETTE[block % len(PALETTE)])
                if length > 0.006 * (rows.stop - rows.start) / 1000:
                    part.text(
                        left + length / 2,
                        lane,
                        str(block),
                        ha="center",
                        va="center",
                        size=6.5,
                        color="white",
                    )
    part.set_yticks(range(len(SLOTS)), list(reversed(SLOTS)))
    part.set_ylim(-0.6, len(SLOTS) - 0.4)
    part.set_title("blocks, by slot", loc="left", size=10)
