"""Write DBC files, for tools that observe a bus."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from fsmkit.carriers.can.dbc import Message, Signal
from fsmkit.emit import Namer, printing
from fsmkit.language import EnumType, FloatType

_WORDS = """
    BA_ BA_DEF_ BA_DEF_DEF_ BA_DEF_DEF_REL_ BA_DEF_REL_ BA_DEF_SGTYPE_ BA_REL_ BA_SGTYPE_ BO_
    BO_TX_BU_ BS_ BU_ BU_BO_REL_ BU_EV_REL_ BU_SG_REL_ CAT_ CAT_DEF_ CM_ ENVVAR_DATA_ EV_ EV_DATA_
    FILTER NS_ NS_DESC_ SG_ SG_MUL_VAL_ SGTYPE_ SGTYPE_VAL_ SIG_GROUP_ SIG_TYPE_REF_ SIG_VALTYPE_
    SIGTYPE_VALTYPE_ VAL_ VAL_TABLE_ VERSION Vector__XXX
"""
WORDS = frozenset(_WORDS.split())
"""Words of DBC files, which no name may be."""
FD_FORMAT = 14
"""The place of `StandardCAN_FD` among the formats that the attribute `VFrameFormat` has."""
FORMATS = ["StandardCAN", "ExtendedCAN", *["reserved"] * 12, "StandardCAN_FD", "ExtendedCAN_FD"]


@dataclass(frozen=True, slots=True)
class Entry:
    """A message in a file; ``comment``: for people."""

    message: Message
    comment: str


@printing
def dbc_text(nodes: Sequence[str], entries: Iterable[Entry]) -> str:
    """Return the content of a file; senders and receivers of messages are names of ``nodes``."""
    namer = Namer(WORDS)
    names = {node: namer.name(node) for node in nodes}
    every = tuple(entries)
    lines = ['VERSION ""', "", "NS_ :", "", "BS_:", "", f"BU_: {' '.join(names.values())}", ""]
    for entry in every:
        lines += [*_message_lines(entry.message, names), ""]
    for entry in every:
        lines.append(f'CM_ BO_ {entry.message.frame} "{_text(entry.comment)}";')
    formats = ",".join(f'"{name}"' for name in FORMATS)
    lines += ['BA_DEF_ BO_ "GenMsgCycleTime" INT 0 65535;']
    lines += [f'BA_DEF_ BO_ "VFrameFormat" ENUM {formats};']
    lines += ['BA_DEF_DEF_ "GenMsgCycleTime" 0;', 'BA_DEF_DEF_ "VFrameFormat" "StandardCAN";']
    for entry in every:
        frame = entry.message.frame
        if entry.message.cycle:
            lines.append(f'BA_ "GenMsgCycleTime" BO_ {frame} {min(entry.message.cycle, 65535)};')
        if entry.message.is_fd:
            lines.append(f'BA_ "VFrameFormat" BO_ {frame} {FD_FORMAT};')
    for entry in every:
        lines += _types(entry.message)
    return "\n".join(lines) + "\n"


def _message_lines(message: Message, names: dict[str, str]) -> Iterator[str]:
    """Yield the line of a message (``BO_``) and those of its signals (``SG_``)."""
    (sender,) = message.senders
    receivers = ",".join(names[name] for name in names if name in message.receivers)
    yield f"BO_ {message.frame} {message.name}: {message.length} {names[sender]}"
    for signal in message.signals:
        lo, hi = signal.bounds
        yield (
            f" SG_ {signal.name} : {signal.start}|{signal.bits}@1"
            f"{'-' if signal.is_signed else '+'} ({signal.sign},{signal.shift}) "
            f'[{_range(signal, lo, hi)}] "" {receivers or "Vector__XXX"}'
        )


def _range(signal: Signal, lo: int, hi: int) -> str:
    return "0|0" if isinstance(signal.type, FloatType) else f"{lo}|{hi}"


def _types(message: Message) -> Iterator[str]:
    """Yield the attributes of signals beside their bits: names of values, and floats."""
    for signal in message.signals:
        if isinstance(signal.type, EnumType):
            named = zip(signal.members, signal.type.members, strict=True)
            values = " ".join(f'{raw} "{_text(name)}"' for raw, name in named)
            yield f"VAL_ {message.frame} {signal.name} {values} ;"
        elif isinstance(signal.type, FloatType):
            kind = 1 if signal.bits == 32 else 2
            yield f"SIG_VALTYPE_ {message.frame} {signal.name} : {kind};"


def _text(text: str) -> str:
    """Return a text that ends neither the string nor its line; characters are single bytes."""
    kept = (c if " " <= c <= "~" and c not in '"\\' else "?" for c in text)
    return "".join(kept)
