"""Random content of SCXML with the ECMAScript data model, as source.

Most of it has a meaning. Some is an error of content by the standard (SCXML 5.9), which every
runtime must handle equally.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from xml.sax.saxutils import quoteattr

from devtools.random_charts.choices import Choices
from devtools.random_charts.content import MOST_TURNS, SENDS, SENT, TURNS

NUMBERS = ("n0", "n1", "n2")
STRINGS = ("s0", "s1")
WORDS = ("idle", "busy", "late", "")
DELAYS = ("10ms", "1ms", "20ms", ".005s", "35ms", "0.01s")
TYPES = ("external", "internal", "platform", "other")
LATER = "wait"
"""A variable that only ever holds delays."""
IDS = "key"
"""A variable that holds ids of delayed sends."""
TEXT, MADE = "t0", "t1"
"""Variables with few string values: those below, and results of methods on them."""
TEXTS = ("up.1", "down.22", "x")
OPEN, OTHER = "seen", "kept"
"""Arrays whose types have no length."""
OBJECT = "pair"
"""An object whose members are assigned later."""
MAYBE = "maybe"
"""A variable without a start value."""
BAD = ("nowhere + 1", "n0.foo()", "new Date()", "n0 +", "_event.data.nothing", "(function() {})()")


@dataclass(frozen=True, slots=True)
class Message:
    """An event of the chart: the form of its payload, and the kinds of its fields."""

    name: str
    numbers: tuple[str, ...] = ()
    strings: tuple[str, ...] = ()
    style: str = "param"
    """``param``, ``namelist``, ``content`` (one number) or ``json``."""


MESSAGES = (
    Message("e0"),
    Message("e1", ("p",)),
    Message("e2", ("p",), ("q",)),
    Message("group.g3", ("n0",), ("s0",), "namelist"),
    Message("e4", ("",), (), "content"),
    Message("group.g5", ("k",), ("l",), "json"),
    Message("e6", (), ("q",)),
)


def is_below(counter: str, most: int) -> str:
    """Return the condition that a counter allows another turn.

    All numbers of this data model are `int32`. A damaged snapshot may hold a counter far below
    zero, and the machine would then send itself events without an end that a test can wait for.
    """
    return f"0 <= {counter} && {counter} < {most}"


def tag(element: str, body: str = "", /, **attributes: str | None) -> str:
    """Return an element without attributes that are None; a trailing `_` of names is removed."""
    given = "".join(
        f" {key.rstrip('_')}={quoteattr(value)}"
        for key, value in attributes.items()
        if value is not None
    )
    return f"<{element}{given}>{body}</{element}>" if body else f"<{element}{given}/>"


@dataclass(frozen=True)
class Script:
    """Makes expressions and statements."""

    choices: Choices
    states: tuple[str, ...]
    message: Message | None = field(default=None)
    """The current event, if it is known."""

    # --- expressions ------------------------------------------------------------------------

    def number(self, depth: int = 2) -> str:
        """Return an expression of a whole number, mostly."""
        kind = self.choices.integer(0, 18) if depth > 0 else self.choices.integer(0, 3)
        match kind:
            case 15:
                return self.choices.pick(
                    (f"{TEXT}.length", f"{TEXT}.indexOf('.')", f"{MADE}.length")
                )
            case 16:
                return self.choices.pick((f"{OPEN}.length", f"{OTHER}.length", f"{OPEN}[n0 % 3]"))
            case 17:
                return f"{OBJECT}.{self.choices.pick('ab')}"
            case 18:
                by = self.choices.pick(("-3", "2", "-2", "7"))
                return f"Math.{self.choices.pick(('round', 'floor', 'ceil'))}(n1 / {by})"
            case 0:
                return str(self.choices.integer(0, 12))
            case 1 | 2 | 4:
                return self.choices.pick(NUMBERS)
            case 3 | 5 if self.message is not None and self.message.numbers:
                part = self.choices.pick(self.message.numbers)
                return f"_event.data.{part}" if part else "_event.data"
            case 6:
                place = self.choices.pick(("0", "1", "2", "n1", "n1 % 3"))
                return f"numbers[{place}]"
            case 7:
                return "numbers.length"
            case 8:
                function = self.choices.pick(("Math.min", "Math.max"))
                return f"{function}({self.number(depth - 1)}, {self.number(depth - 1)})"
            case 9:
                return f"Math.abs({self.number(depth - 1)})"
            case 10:
                then, otherwise = self.number(depth - 1), self.number(depth - 1)
                return f"({self.test(depth - 1)} ? {then} : {otherwise})"
            case 11:
                whole = self.choices.pick(("numbers.length", "Math.abs(n0)", self.number(0)))
                rounding = self.choices.pick(("Math.floor", "Math.ceil", "Math.trunc"))
                return f"{rounding}({whole} / {self.choices.integer(1, 4)})"
            case 14:
                return self.choices.pick(("Math.sign(n0 - 4)", "Math.round(2.5)", "Math.pow(2, 3)"))
            case 12 | 13:
                op = self.choices.pick(("+", "-", "*", "%", "&", "|", "^", "<<"))
                small = op in {"%", "<<"}
                right = str(self.choices.integer(2, 9)) if small else self.number(depth - 1)
                return f"({self.number(depth - 1)} {op} {right})"
            case _:
                return self.choices.pick(NUMBERS)

    def string(self) -> str:
        """Return an expression of a string."""
        kind = self.choices.integer(0, 9)
        if kind in (6, 7) and self.message is not None and self.message.strings:
            return f"_event.data.{self.choices.pick(self.message.strings)}"
        if kind == 9:
            return "_event.type"
        if kind == 8:
            return f"({self.test(1)} ? {self._literal()} : {self.choices.pick(STRINGS)})"
        return self.choices.pick(STRINGS) if kind in (3, 4, 5) else self._literal()

    def _literal(self) -> str:
        quote = self.choices.pick(("'", '"'))
        return f"{quote}{self.choices.pick(WORDS)}{quote}"

    def fraction(self) -> str:
        """Return an expression of a number with a fraction."""
        return self.choices.pick((f"{self.number(1)} / 2", "x0 * 0.5", "x0 + 1.25", "n0 - 0.5"))

    def test(self, depth: int = 2) -> str:
        """Return a condition."""
        kind = self.choices.integer(0, 21) if depth > 0 else self.choices.integer(0, 3)
        match kind:
            case 19:
                return self.choices.pick((f"{TEXT}.startsWith('up')", f"{MADE} == 'UP'"))
            case 20:
                return f"{TEXT}.split('.')[0].toUpperCase() == {MADE}"
            case 21 if self.message is not None:
                return self.choices.pick(("_event.data && flag", "!_event.data"))
            case 0:
                return "flag"
            case 1 | 2 | 4 | 5 | 6:
                op = self.choices.pick(("<", "<=", "==", "!=", "===", "!==", ">", ">="))
                return f"{self.number(depth - 1)} {op} {self.choices.pick(NUMBERS)}"
            case 3 if self.states:
                return f"In('{self.choices.pick(self.states)}')"
            case 7 | 8:
                op = self.choices.pick(("==", "===", "!=", "!=="))
                return f"{self.string()} {op} {self.string()}"
            case 9:
                return f"!({self.test(depth - 1)})"
            case 10 | 11:
                op = self.choices.pick(("&&", "||"))
                return f"({self.test(depth - 1)}) {op} ({self.test(depth - 1)})"
            case 12:
                return self.choices.pick((*NUMBERS, *STRINGS, "x0"))
            case 13:
                what = (f"typeof {MAYBE} === 'undefined'", f"{MAYBE} == null", f"{MAYBE} != null")
                return self.choices.pick(what)
            case 14:
                return f"x0 > {self.number(0)}"
            case 15 if self.message is not None:
                return f"_event.name == '{self.choices.pick(MESSAGES).name}'"
            case 16:
                return f"_event.type == '{self.choices.pick(TYPES)}'"
            case 17:
                return self.choices.pick(("In('nowhere')", "!In('nowhere')"))
            case _:
                return self.choices.pick(("true", "false"))

    def guard(self) -> str:
        """Return a condition that now and then cannot be evaluated: it is false then (5.9.1)."""
        return self.choices.pick(BAD) if self.choices.chance(4) else self.test()

    # --- statements -------------------------------------------------------------------------

    def block(self, most: int = 3) -> str:
        """Return one to ``most`` statements."""
        return "".join(self.statement(2) for _ in range(self.choices.integer(1, most)))

    def statement(self, depth: int) -> str:
        """Return one statement, with up to ``depth`` levels of statements in it."""
        kind = self.choices.integer(0, 26)
        match kind:
            case 23:
                return tag("assign", location=TEXT, expr=f"'{self.choices.pick(TEXTS)}'")
            case 24:
                made = self.choices.pick((f"{TEXT}.slice(0, 2).toUpperCase()", f"{TEXT} + '!'"))
                return tag("assign", location=MADE, expr=made)
            case 25:
                return tag("assign", location=self._place(), expr=self.number(1))
            case 26:
                return self.choices.pick((
                    tag("assign", location=OTHER, expr=OPEN),
                    tag("assign", location=f"{OPEN}.length", expr="0"),
                    tag("assign", location=OBJECT, expr=f"{{a: {self.number(0)}, b: 2}}"),
                ))  # fmt: skip
            case 0 | 1 | 2:
                shown = self.choices.pick((self.number(1), self.string(), self.fraction()))
                return tag("log", label=self.choices.pick(("at", None)), expr=shown)
            case 3 | 4 | 5 | 6:
                name, value = self._assigned()
                return tag("assign", location=name, expr=value)
            case 7 | 8:
                return f"<script>{_escaped(self.script(2))}</script>"
            case 9 | 10:
                return self._counted(TURNS, MOST_TURNS, self._raised())
            case 11 | 12 | 13:
                return self._delayed()
            case 14:
                return self._counted(SENT, SENDS, self.send(self.choices.pick(MESSAGES)))
            case 15:
                return self._cancel()
            case 16 | 17 if depth > 0:
                return self._if(depth)
            case 18 if depth > 0:
                return self._foreach(depth)
            case 19:
                return self._bad()
            case _:
                return tag("assign", location="n0", expr="n0 + 1")

    def _place(self) -> str:
        places = (f"{OPEN}[{OPEN}.length]", f"{OPEN}[{OPEN}.length]", f"{OPEN}[1]", f"{OTHER}[n0]")
        return self.choices.pick((*places, f"{OBJECT}.a", f"{OBJECT}.b"))

    def _assigned(self) -> tuple[str, str]:
        kind = self.choices.integer(0, 9)
        match kind:
            case 0 | 1 | 2 | 3:
                return self.choices.pick(NUMBERS), self.number()
            case 4 | 5:
                return self.choices.pick(STRINGS), self.string()
            case 6:
                return "flag", self.test(1)
            case 7:
                return "x0", self.fraction()
            case 8:
                return MAYBE, self.number(1)
            case _:
                return f"numbers[{self.choices.pick(('0', '1', 'n2'))}]", self.number(1)

    def script(self, depth: int) -> str:
        """Return statements of ECMAScript."""
        found = []
        for _ in range(self.choices.integer(1, 3)):
            name, value = self._assigned()
            kind = self.choices.integer(0, 5)
            number = self.choices.pick(NUMBERS)
            if kind == 3:
                found.append(f"{number} {self.choices.pick(('+=', '-=', '*='))} {self.number(0)};")
            elif kind == 4:
                found.append(f"{number}{self.choices.pick(('++', '--'))};")
            elif kind == 5 and depth > 0:
                then, otherwise = self.script(depth - 1), self.script(depth - 1)
                found.append(f"if ({self.test(1)}) {{ {then} }} else {{ {otherwise} }}")
            else:
                found.append(f"{name} = {value};")
        return " ".join(found)

    def _counted(self, counter: str, most: int, statement: str) -> str:
        count = tag("assign", location=counter, expr=f"{counter} + 1")
        return tag("if", count + statement, cond=is_below(counter, most))

    def _raised(self) -> str:
        if self.choices.chance(50):
            return self.send(self.choices.pick(MESSAGES), target="#_internal")
        return tag("raise", event=self.choices.pick(("r0", "r1", "group.r2")))

    def _delayed(self) -> str:
        delay: dict[str, str | None] = {"delay": self.choices.pick(DELAYS)}
        if self.choices.chance(30):
            delay = {"delayexpr": self.choices.pick((LATER, "'5ms'", "'2ms'"))}
        match self.choices.integer(0, 4):
            case 0 | 1:
                delay["id"] = f"id{self.choices.integer(0, 2)}"
            case 2:
                delay["idlocation"] = IDS
        if self.choices.chance(15):
            name = tag("assign", location=LATER, expr=f"'{self.choices.pick(DELAYS)}'")
            return name + self.send(self.choices.pick(MESSAGES), **delay)
        return self.send(self.choices.pick(MESSAGES), **delay)

    def send(self, message: Message, **attributes: str | None) -> str:
        """Return a send of an event with its payload."""
        body = ""
        match message.style:
            case "namelist":
                attributes["namelist"] = " ".join((*message.numbers, *message.strings))
            case "content" if self.choices.chance(50):
                body = tag("content", expr=self.number(1))
            case "content":
                body = tag("content", str(self.choices.integer(0, 9)))
            case "json":
                number, word = self.choices.integer(0, 9), self.choices.pick(WORDS)
                body = tag("content", _escaped(f'{{"k": {number}, "l": "{word}"}}'))
            case _:
                body = "".join(tag("param", name=n, expr=self.number(1)) for n in message.numbers)
                body += "".join(tag("param", name=s, expr=self.string()) for s in message.strings)
        if self.choices.chance(15):
            return tag("send", body, eventexpr=f"'{message.name}'", **attributes)
        return tag("send", body, event=message.name, **attributes)

    def _cancel(self) -> str:
        name = f"id{self.choices.integer(0, 2)}"
        if self.choices.chance(30):
            return tag("cancel", sendidexpr=f"'{name}'")
        return tag("cancel", sendid=name)

    def _if(self, depth: int) -> str:
        body = self.statement(depth - 1)
        if self.choices.chance(40):
            body += tag("elseif", cond=self.test(1)) + self.statement(depth - 1)
        if self.choices.chance(50):
            body += tag("else") + self.statement(depth - 1)
        return tag("if", body, cond=self.guard())

    def _foreach(self, depth: int) -> str:
        array, item = self.choices.pick((("numbers", "item"), ("numbers", "n2"), ("words", "word")))
        index = "place" if self.choices.chance(50) else None
        shown = self.choices.pick((item, "n0" if index is None else index))
        body = tag("log", expr=shown) + self.statement(depth - 1)
        return tag("foreach", body, array=array, item=item, index=index)

    def _bad(self) -> str:
        """Return content that fails when executed, after which the block ends (4.2)."""
        bad = self.choices.pick(BAD)
        return self.choices.pick(
            (
                tag("assign", location="nowhere", expr="1"),
                tag("assign", location="n0", expr=bad),
                tag("log", expr=bad),
                tag("foreach", tag("log", expr="n0"), array="n0", item="item"),
                tag("send", event="e0", target="!nowhere"),
                tag("send", event="e0", target="#_scxml_unheard_of"),
                tag("if", tag("log", expr="n0") + tag("else") + tag("log", expr="1"), cond=bad),
                tag("unheard_of"),
                tag("send", event="e0", target="#_scxml_unheard_of", delay="1ms"),
            )
        )


def _escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
