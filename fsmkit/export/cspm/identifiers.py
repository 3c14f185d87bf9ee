"""Choose names in CSPm: legal, distinct, and different from predefined ones.

Predefined names can be redefined, which silently changes the meaning of their uses. They are
therefore reserved like keywords.
"""

from __future__ import annotations

from fsmkit.emit import Emitter
from fsmkit.emit.lines import one_line
from fsmkit.export.identifiers import Names

RESERVED = """
    and assert channel datatype else endmodule exports external false if include instance let module
    not nametype or print subtype then Timed transparent true within
"""
BUILT_IN = """
    Bool BUFFER card CHAOS Char chase chase_nocache concat dbisim deter diamond diff DIV elem
    empty emptyMap error Events explicate extensions failure_watchdog False fdr head Int Inter
    inter lazyenumerate lazynorm length loop Map mapDelete mapFromList mapLookup mapMember
    mapToList mapUpdate mapUpdateMultiple member model_compress mtransclose normal normalise
    null prioritise prioritise_nocache prioritisepo priority Proc productions relational
    relational_image relational_inverse_image RUN sbisim Seq seq Set set show SIGNAL_BUFFER SKIP
    STOP synchronise tail tau_loop_factor tick timed_priority tock trace_watchdog transpose True
    TSKIP TSTOP Union union WAIT wbisim WEAK_BUFFER
"""
TAKEN = frozenset((RESERVED + BUILT_IN).split())


class Frame:
    """Names that every model has, chosen last: names of the system take precedence."""

    def __init__(self, names: Names) -> None:
        """Take the names."""
        take = names.take
        self.start, self.unseen, self.violated = take("start"), take("unseen"), take("violated")
        self.label, self.property = take("LABEL"), take("PROPERTY")
        self.alphabet, self.part, self.post = take("ALPHABET"), take("PART"), take("POST")
        self.network, self.system, self.visible = take("NETWORK"), take("SYSTEM"), take("VISIBLE")
        self.internal, self.only = take("INTERNAL"), take("ONLY")
        self.time = take("TIME")
        self.e, self.s, self.n, self.m = take("e"), take("s"), take("n"), take("m")


def comment(text: str) -> str:
    """Return a text for a comment, which ends with its line.

    CSPm scripts are ASCII: no reader states another encoding.
    """
    return " ".join(one_line(text).encode("ascii", "backslashreplace").decode().split())


def format_names(names: list[str], indent: str, opening: str = "{", closing: str = "}") -> str:
    """Return a set or a list, broken into lines of a moderate length."""
    lines, line = [], ""
    for name in names:
        piece = name if not line else f", {name}"
        if line and len(line) + len(piece) > 88 - len(indent):
            lines.append(f"{line},")
            piece, line = name, ""
        line += piece
    lines.append(line)
    return f"{opening}{f'{chr(10)}{indent} '.join(lines)}{closing}"


def offer(variable: str, events: list[str], to: str) -> str:
    """Return a process that offers events with the same continuation."""
    if len(events) == 1:
        return f"({events[0]} -> {to})"
    return f"([] {variable} : {format_names(events, '      ')} @ ({variable} -> {to}))"


class Script(Emitter):
    """The lines of a script."""

    def __init__(self) -> None:
        """Start without lines."""
        super().__init__("  ")

    def equation(self, name: str, terms: list[str]) -> None:
        """Write an equation of a process that offers all terms."""
        self.line(f"{name} =")
        if not terms:
            self.line("  STOP")
        for number, term in enumerate(terms):
            self.line(f"  {'[] ' if number else '   '}{term}")

    def remark(self, text: str) -> None:
        """Write a comment, line by line."""
        for line in text.splitlines():
            self.line(f"-- {one_line(line)}".rstrip())

    def title(self, text: str) -> None:
        """Write a comment at the start of a part."""
        self.remark(f"--- {comment(text)} {'-' * (80 - len(text))}")
        self.line()
