"""A sequence diagram in the language of Mermaid."""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.emit import notating
from fsmkit.emit.mermaid import in_sequence
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
    Transport.DIRECT: "->>",
    Transport.VALUE: "-->>",
    Transport.QUEUED: "-)",
    Transport.DELAYED: "-)",
    Transport.LOSSY: "--)",
}


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
        yield "sequenceDiagram"
        yield f"  title {in_sequence(sequence.title)}"
        if sequence.has_outside:
            yield "  actor outside"
        for number, line in enumerate(sequence.lifelines):
            yield f"  participant m{number} as {in_sequence(line.name)}"
        for part in sequence.parts:
            if not isinstance(part, Repetition):
                yield from self._block(part)
                continue
            yield f"  loop {part.heading}"
            for block in part.blocks:
                yield from self._block(block)
            yield "  end"
        yield f"  Note over {self._all}: {'<br/>'.join(map(in_sequence, sequence.end))}"

    @property
    def _all(self) -> str:
        last = len(self._sequence.lifelines) - 1
        return f"m0,m{last}" if last else "m0"

    def _block(self, block: Block) -> Iterator[str]:
        if block.at and block.at != self._time:
            yield f"  Note over {self._all}: {block.at}"
            self._time = block.at
        if block.lifeline is not None:
            if block.cause is Cause.OUTSIDE:
                yield f"  outside->>m{block.lifeline}: {in_sequence(block.text)}"
            if block.remarks:
                remarks = "<br/>".join(map(in_sequence, block.remarks))
                yield f"  Note over m{block.lifeline}: {remarks}"
        for arrow in block.arrows:
            yield f"  {_arrow(arrow)}"


def _arrow(arrow: Arrow) -> str:
    shape = {Part.LOST: "--x", Part.SENT: "--)"}.get(arrow.part, ARROWS[arrow.transport])
    source, target = ("outside" if n is None else f"m{n}" for n in (arrow.source, arrow.target))
    return f"{source}{shape}{target}: {in_sequence(arrow.label)}"
