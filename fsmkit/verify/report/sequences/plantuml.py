"""A sequence diagram in the language of PlantUML."""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.chart.drawing.states.dot.draw import INK, WATCHDOG
from fsmkit.emit import notating
from fsmkit.emit.plantuml import escaped
from fsmkit.verify.report.sequences.model import (
    Arrow,
    Block,
    Cause,
    Part,
    Repetition,
    Sequence,
    Transport,
)

ARROWS = {
    Transport.DIRECT: "->",
    Transport.VALUE: "-->>",
    Transport.QUEUED: "->>",
    Transport.DELAYED: "->>",
    Transport.LOSSY: f"-[{WATCHDOG}]->>",
}
STYLE = (
    "hide footbox",
    "skinparam shadowing false",
    f"skinparam sequenceArrowColor {INK}",
    f"skinparam sequenceLifeLineBorderColor {INK}",
)


@notating
def draw(sequence: Sequence) -> str:
    """Return the text of a diagram."""
    return "\n".join((*_Writer(sequence).lines(), ""))


class _Writer:
    def __init__(self, sequence: Sequence) -> None:
        self._sequence = sequence
        self._time = ""

    def lines(self) -> Iterator[str]:
        sequence = self._sequence
        yield "@startuml"
        yield f"title {escaped(sequence.title)}"
        yield from STYLE
        for number, line in enumerate(sequence.lifelines):
            kind = "entity" if line.is_environment else "participant"
            yield f'{kind} "{escaped(line.name)}" as m{number}'
        for part in sequence.parts:
            if not isinstance(part, Repetition):
                yield from self._block(part)
                continue
            yield f"loop {part.heading}"
            for block in part.blocks:
                yield from self._block(block)
            yield "end"
        color = "#fef2f2" if sequence.violated else "#f0fdf4"
        yield f"note over {self._all} {color}"
        yield from map(escaped, sequence.end)
        yield "end note"
        yield "@enduml"

    @property
    def _all(self) -> str:
        last = len(self._sequence.lifelines) - 1
        return f"m0, m{last}" if last else "m0"

    def _block(self, block: Block) -> Iterator[str]:
        if block.at and block.at != self._time:
            yield f"== {block.at} =="
            self._time = block.at
        if block.lifeline is not None:
            if block.cause is Cause.OUTSIDE:
                yield f"[-[{WATCHDOG}]> m{block.lifeline} : {escaped(block.text)}"
            if block.remarks:
                yield f"rnote over m{block.lifeline} #fff8e1"
                yield from map(escaped, block.remarks)
                yield "end rnote"
        for arrow in block.arrows:
            yield _arrow(arrow)


def _arrow(arrow: Arrow) -> str:
    text = escaped(arrow.label)
    shape = {Part.LOST: "->x", Part.SENT: "->o"}.get(arrow.part, ARROWS[arrow.transport])
    if arrow.target is None:
        return f"m{arrow.source} ->] : {text}"
    return f"m{arrow.source} {shape} m{arrow.target} : {text}"
