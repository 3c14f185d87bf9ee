"""Mistakes that people make, in both notations, and the words that tell the cause and a way out.

Each is an edit of a file beside this one, which has no mistake. Edits of `gate` come in YAML and in
SCXML; where a notation does not know a mistake, there is none. Words that differ by notation are
pairs. Mistakes of the command line are arguments.
"""

from __future__ import annotations

from typing import NamedTuple

Edit = tuple[str, str]
Words = str | tuple[str, str]
"""The same for both notations, or for YAML and for SCXML."""


class Mistake(NamedTuple):
    """What is wrong and what has to be said. ``place``: line and column, where it is not plain."""

    file: str
    yaml: Edit | None
    scxml: Edit | None
    cause: Words
    way_out: Words
    place: str = ""


def guard(wrong: str, cause: Words, way_out: Words) -> Mistake:
    """Return a mistake in a guard."""
    quoted = wrong.replace('"', '\\"')
    marked = wrong.replace("&", "&amp;").replace("<", "&lt;").replace('"', "&quot;")
    return Mistake(
        "gate",
        ("if: event.v > 2", f'if: "{quoted}"'),
        ('cond="event.v > 2"', f'cond="{marked}"'),
        cause,
        way_out,
    )


def content(wrong: str, cause: Words, way_out: Words) -> Mistake:
    """Return a mistake in the statements of a transition."""
    quoted = wrong.replace('"', '\\"')
    marked = wrong.replace("&", "&amp;").replace("<", "&lt;")
    return Mistake(
        "gate",
        ("do: n = event.v", f'do: "{quoted}"'),
        ('<assign location="n" expr="event.v"/>', f"<script>{marked}</script>"),
        cause,
        way_out,
    )


def delay(wrong: str, cause: Words, way_out: Words) -> Mistake:
    """Return a mistake in a delay."""
    return Mistake(
        "gate",
        ("T_OPEN: b", f'"{wrong}": b'),
        ('after="T_OPEN"', f'after="{wrong}"'),
        cause,
        way_out,
    )


def typed(wrong: str, start: str, cause: Words, way_out: Words) -> Mistake:
    """Return a mistake in the declaration of a variable."""
    return Mistake(
        "gate",
        ("n: 0..9 = 0", f"n: {wrong} = {start}"),
        ('fk:type="0..9" expr="0"', f'fk:type="{wrong}" expr="{start}"'),
        cause,
        way_out,
    )


def target(wrong: str, cause: Words, way_out: Words) -> Mistake:
    """Return a mistake in a target."""
    return Mistake(
        "gate",
        ("T_OPEN: b", f'T_OPEN: "{wrong}"'),
        ('"T_OPEN" target="b"', f'"T_OPEN" target="{wrong}"'),
        cause,
        way_out,
    )


def key(yaml: Edit, scxml: Edit | None, cause: Words, way_out: Words) -> Mistake:
    """Return a mistake in a key, an element or an attribute of a chart."""
    return Mistake("gate", yaml, scxml, cause, way_out)


def markup(wrong: Edit, cause: str, way_out: str) -> Mistake:
    """Return a mistake that only XML knows."""
    return Mistake("gate", None, wrong, cause, way_out)


def line(was: str, wrong: str, cause: str, way_out: str) -> Mistake:
    """Return a mistake in a system."""
    return Mistake("line.yaml", (was, wrong), None, cause, way_out)


def wire(wrong: str, cause: str, way_out: str) -> Mistake:
    """Return a mistake in a connection."""
    return line("- gate.ready -> guard[0].came", f"- {wrong}", cause, way_out)


def never(wrong: str, cause: str, way_out: str) -> Mistake:
    """Return a mistake in the condition of a property."""
    return line("gate.In(d) and guard[0].light", wrong, cause, way_out)


def suite(was: str, wrong: str, cause: str, way_out: str) -> Mistake:
    """Return a mistake in a file of tests."""
    return Mistake("gate.test.yaml", (was, wrong), None, cause, way_out)


def binding(was: str, wrong: str, cause: str, way_out: str) -> Mistake:
    """Return a mistake in a binding."""
    return Mistake("gate.c.yaml", (was, wrong), None, cause, way_out)


def project(was: str, wrong: str, cause: str, way_out: str) -> Mistake:
    """Return a mistake in the project file."""
    return Mistake("fsmkit.toml", (was, wrong), None, cause, way_out)


NO_UNIT = "is not a unit; units are us, ms, s, m, h, d"
NO_XML = "this is not XML: "

LAYOUT = {
    "a blank too many before a key": Mistake(
        "gate",
        ("    on:\n      go: a\n", "     on:\n      go: a\n"),
        None,
        "this line is indented by 5, the entries before it by 4",
        "fix: indent it by 4",
        "gate.yaml:40:6",
    ),
    "a blank too few": Mistake(
        "gate",
        ("    initial: c\n", "   initial: c\n"),
        None,
        "this line is indented by 3, the entries before it by 4",
        "fix: indent it by 4",
        "gate.yaml:39:4",
    ),
    "a blank too few in a system": Mistake(
        "line.yaml",
        ("  seen:", " seen:"),
        None,
        "this line is indented by 1, the entries before it by 2",
        "fix: indent it by 2",
    ),
    "a tab": Mistake(
        "gate",
        ("    after:\n      T_OPEN", "\tafter:\n      T_OPEN"),
        None,
        "YAML is indented with blanks; here is a tab",
        "fix: write two blanks for each tab",
    ),
    "blanks and a tab": Mistake(
        "gate.test.yaml",
        ("    - wait", "  \t- wait"),
        None,
        "YAML is indented with blanks; here is a tab",
        "fix: write two blanks for each tab",
    ),
    "no blank after a colon": key(
        ("initial: a\n", "initial:a\n"),
        ('event="go" target="b"', 'event=go target="b"'),
        ("a blank is missing after the colon", f"{NO_XML}a value without quotes"),
        ("write `initial: a`", 'put it into quotes: `name="value"`'),
    ),
    "no blank after the only colon of a section": key(
        ("          2s: c", "          2s:c"),
        None,
        "`after` must be keys with values",
        "put a blank after the colon: `2s: c`",
    ),
    "no blank after a dash": suite(
        "- wait 4s", "-wait 4s", "a blank is missing after the dash", "write `- wait 4s`"
    ),
    "a colon in a text": key(
        ("doc: A gate.", "doc: A gate: it opens."),
        None,
        "mapping values are not allowed here",
        'a text with `: ` must be quoted: `doc: "A gate: it opens."`',
    ),
    "brackets in braces": key(
        ('do: "slots[1] = next(n % 8)"', "do: slots[1] = next(n % 8)"),
        None,
        "expected ',' or '}', but got '['",
        'must be quoted: `"slots[1] = next(n % 8)"`',
    ),
    "a comma in braces": key(
        ("do: n = event.v}", "do: n = max(event.v, 2)}"),
        None,
        "YAML split this text at a comma",
        'quote it: "n = max(event.v, 2)"',
    ),
    "a comma is missing": key(
        ("{if: event.v > 2, do:", "{if: event.v > 2 do:"),
        ('event="set" cond="event.v', 'event="set"cond="event.v'),
        ("a comma is missing before `do:`", "a blank is missing between two attributes"),
        ("write `, do:`", "put a blank before this one"),
    ),
    "a bracket is not closed": key(
        ("do: n = event.v}", "do: n = event.v"),
        ("</state>\n</scxml>", "</scxml>"),
        ("this `{` is not closed", "`</scxml>` is found while `<state>` is still open"),
        ("close it with `}` at the end of its line", "close it before: `</state>`"),
    ),
    "a quote is not closed": key(
        ('"set(v 0..9)"', '"set(v 0..9)'),
        ('event="ask">', 'event="ask>'),
        ("a quote is not closed, or one too many", "a quote is not closed before this line"),
        ('each text has a `"` before and behind it', 'close the value with `"`'),
    ),
    "an entry twice": key(
        ("      again: b\n", "      go: b\n"),
        ('event="go" target="a"', 'event="go" target="a" target="b"'),
        ("`go` is given twice", "an attribute is given twice"),
        ("make a list of both values", "remove one of the two"),
    ),
    "an alias": key(
        ("      go: a\n", "      go: *a\n"),
        None,
        "an alias is not used in charts",
        "write the value out",
    ),
    "two documents": key(
        ("initial: a\n", "---\ninitial: a\n"),
        None,
        "a second document is not used in charts",
        "keep one chart in a file",
    ),
    "a name alone": key(
        ("chart: Gate", "Gate"), None, "`Gate` is no entry", "such as `chart: Gate`"
    ),
    "less than": markup(
        ('cond="event.v > 2"', 'cond="event.v < 2"'), f"{NO_XML}`<` within a value", "write `&lt;`"
    ),
    "an ampersand": markup(
        ('cond="event.v > 2"', 'cond="ok && n > 2"'),
        f"{NO_XML}`&` starts the name of a character",
        "write `&amp;`, or in an expression `and`",
    ),
    "a prefix is not declared": markup(
        (' xmlns:fk="urn:fsmkit:scxml"', ""),
        f"{NO_XML}the prefix `fk` is not declared",
        'add `xmlns:fk="urn:fsmkit:scxml"`',
    ),
    "the namespace of SCXML is missing": markup(
        (' xmlns="http://www.w3.org/2005/07/scxml"', ""),
        "there is no namespace",
        'write `xmlns="http://www.w3.org/2005/07/scxml"`',
    ),
    "an entity of HTML": markup(
        ("A gate.", "A&nbsp;gate."), "`&gt;` `&amp;` `&quot;` `&apos;` are known", "write the char"
    ),
    "tags crossed": markup(
        ("</onentry>\n    <transition", "</transition>\n    <transition"),
        "`</transition>` is found while `<onentry>` is still open",
        "close it before: `</onentry>`",
    ),
}

KEYS = {
    "a key of a system in a chart": key(
        ("initial: a\n", "shared: {p: 0..3}\ninitial: a\n"),
        None,
        "a chart has no key `shared`",
        "`shared` belongs to a system",
    ),
    "a key of a transition in a state": key(
        ("    after:\n      T_OPEN", "    target: b\n    after:\n      T_OPEN"),
        ('<state id="d">', '<state id="d" target="a">'),
        ("state `a` has no key `target`", "`<state>` has no attribute `target`"),
        ("`target` belongs to a transition", "`target` belongs to `<transition>`"),
    ),
    "a misspelt key": key(
        ("operations:", "opperations:"),
        ("<fk:operation ", "<fk:opperation "),
        ("a chart has no key `opperations`", "`<fk:opperation>` has no meaning in `<scxml>`"),
        ("did you mean `operations`?", "did you mean `fk:operation`?"),
    ),
    "a key in capitals": key(
        ("states:\n  a:", "States:\n  a:"),
        ("<onexit>", "<onExit>"),
        ("a chart has no key `States`", "`</onexit>` is found while `<onExit>` is still open"),
        ("did you mean `states`?", "close it before: `</onExit>`, or correct the name"),
    ),
    "variables of another tool": key(
        ("data:\n", "context:\n"),
        ('<data id="n"', '<data name="n"'),
        ("a chart has no key `context`", "`<data>` has no attribute `name`"),
        ("did you mean `data`?", "did you mean `id`?"),
    ),
    "the name of a chart": key(
        ("chart: Gate", "name: Gate"),
        ('name="Gate"', 'id="Gate"'),
        ("a chart has no key `name`", "`<scxml>` has no attribute `id`"),
        ("did you mean `chart`?", "did you mean `name`?"),
    ),
    "a guard as other tools call it": key(
        ("{if: event.v", "{guard: event.v"),
        ('cond="event.v', 'guard="event.v'),
        ("a transition has no key `guard`", "`<transition>` has no attribute `guard`"),
        ("did you mean `if`?", "did you mean `cond`?"),
    ),
    "an action as other tools call it": key(
        ("do: n = event.v", "actions: n = event.v"),
        ('<assign location="n" expr="event.v"/>', "<action>n = event.v</action>"),
        ("a transition has no key `actions`", "`<action>` has no meaning in `<transition>`"),
        ("did you mean `do`?", "did you mean `script`?"),
    ),
    "a target as other tools call it": key(
        ("{target: b, do", "{goto: b, do"),
        ('event="go" target="b"', 'event="go" to="b"'),
        ("a transition has no key `goto`", "`<transition>` has no attribute `to`"),
        "did you mean `target`?",
    ),
    "a parallel state by its type": key(
        ("    initial: c\n", "    type: parallel\n"),
        ('<state id="b" initial="c">', '<state id="b" type="parallel">'),
        ("state `b` has no key `type`", "`<state>` has no attribute `type`"),
        ("a parallel state has `regions`", "`<parallel>`, `<final>`"),
    ),
    "a parallel state by a flag": key(
        ("    initial: c\n", "    parallel: true\n"),
        ('<state id="b" initial="c">', '<state id="b" parallel="true">'),
        ("state `b` has no key `parallel`", "`<state>` has no attribute `parallel`"),
        ("did you mean `regions`?", "`<parallel>`, `<final>`"),
    ),
    "a final state by its type": key(
        ("      d:\n", "      d:\n        type: final\n"),
        ('<state id="d">', '<state id="d" type="final">'),
        ("state `d` has no key `type`", "`<state>` has no attribute `type`"),
        ("a final one `final: true`", "`<parallel>`, `<final>`"),
    ),
    "an entry action of another tool": key(
        ("        entry: fault", "        onEnter: fault"),
        ("<onexit>", "<exit>"),
        ("state `d` has no key `onEnter`", "`</onexit>` is found while `<exit>` is still open"),
        ("did you mean `entry`?", "or correct the name"),
    ),
    "a timeout of another tool": key(
        ("    after:\n      T_OPEN: b", "    timeout: 5s"),
        ('fk:after="2s"', 'timeout="2s"'),
        ("state `a` has no key `timeout`", "`<transition>` has no attribute `timeout`"),
        ("did you mean `after`?", "did you mean `fk:after`?"),
    ),
    "a delay without its transition": key(
        ("    after:\n      T_OPEN: b", "    after: 5s"),
        ('fk:after="2s"', 'after="2s"'),
        ("`after` must be keys with values", "`<transition>` has no attribute `after`"),
        ("for instance `after: {5s: target}`", "did you mean `fk:after`?"),
    ),
    "one transition where several are named": key(
        ("      T_OPEN: b", "      delay: 5s\n      target: b"),
        None,
        "`after` names times, each with its transition",
        "write `after: {5s: {target: idle}}`",
    ),
    "the event of a transition by a key": key(
        ("      go: a\n", "      event: go\n      target: a\n"),
        ('event="again"', 'on="again"'),
        ("`on` names events, each with its transition", "has no attribute `on`"),
        ("write `on: {go: {target: idle}}`", "did you mean `event`?"),
    ),
    "transitions as a list": key(
        ("    on:\n      go: a", "    on:\n      - go: a"),
        None,
        "`on` must be keys with values",
        "for instance `on: {event: target}`",
    ),
    "an arrow for a transition": key(
        ("    on:\n      go: a", "    on:\n      go -> a"),
        None,
        "`on` must be keys with values",
        "for instance `on: {event: target}`",
    ),
    "an otherwise in a transition": key(
        ("do: n = event.v}", "do: n = event.v, else: b}"),
        ('expr="event.v"/>', 'expr="event.v"/><else/>'),
        ("a transition has no key `else`", "`<else>` has no meaning in `<transition>`"),
        ("a list of transitions, of which the last has no `if`", "move `<else>` to where"),
    ),
    "events without a direction": key(
        (
            '  in: [go, "set(v 0..9)", "ask() -> 0..9"]\n',
            '  - go\n  - "set(v 0..9)"\n  - again\nentries:\n',
        ),
        ('<fk:event direction="in" signature="go"/>', '<fk:event signature="go"/>'),
        ("`events` must be keys with values", "`<fk:event>` has no `direction`"),
        ("`events: {in: [go], out: [ready]}`", 'add `direction="..."`'),
    ),
    "a direction of another name": key(
        ("  in: [go", "  input: [go"),
        ('direction="in" signature="go"', 'direction="input" signature="go"'),
        ("`events` has no key `input`", "an event does not go `input`"),
        ("use in, internal or out", "use in, out, internal"),
    ),
    "data as a list": key(
        ("inputs: {temp: 0..1000}", "inputs: [temp]"),
        None,
        "`inputs` must be keys with values",
        "for instance `inputs: {temp: 0..100}`",
    ),
    "a state that is a text": key(
        (
            "      d:\n",
            "      e: idle\n      d:\n",
        ),
        None,
        "state `e` must be keys with values",
        "write `key: value` lines",
    ),
    "a flag that is no flag": key(
        ("      d:\n", "      d:\n        rest: yes\n"),
        ('<state id="d">', '<state id="d" fk:rest="yes">'),
        ("`rest` cannot be `yes`", "is `true` or `false`, not `yes`"),
        ("write false or true", "write `true`"),
    ),
    "a final state that goes on": key(
        ("      d:\n", "      d:\n        final: true\n"),
        None,
        "`d` is a final state and is not left by transitions of its own",
        "make it an ordinary state, or put the transition on its parent",
    ),
    "a history without a default": key(
        ("      d:\n", "      h: {history: shallow}\n      d:\n"),
        ('<state id="d">', '<history id="h"/>\n    <state id="d">'),
        "history `h` does not say what is entered the first time",
        "give its default a target",
    ),
    "a choice without an otherwise": key(
        ("      d:\n", "      h: {choice: [{if: ok, target: c}]}\n      d:\n"),
        ("</onexit>", '</onexit><state id="h" fk:kind="choice"><transition cond="ok"/></state>'),
        "the last alternative of choice `h` has a guard: the machine could stay in it",
        "remove that guard, or add an alternative without one",
    ),
}

TIMES = {
    "a unit that is none": delay("5sec", f"`sec` {NO_UNIT}", "write `5s`"),
    "a unit that nobody knows": delay(
        "5fortnights", f"`fortnights` {NO_UNIT}", "write `5ms` or `5s`"
    ),
    "a unit behind a blank": delay("500 msec", f"`msec` {NO_UNIT}", "write `500ms`"),
    "a unit in a constant": key(
        ("T_OPEN: 4s", "T_OPEN: 4min"), ('expr="4s"', 'expr="4min"'), f"`min` {NO_UNIT}", "`4m`"
    ),
    "a unit in a send": content("send go after 5sec", f"`sec` {NO_UNIT}", "write `5s`"),
    "a number without a unit": delay("5", "`5` has no unit", "give it a unit: `5ms`, `5s`"),
    "a constant that is no time": delay(
        "LIMIT", "the number 5 where `duration` is expected", "give the number a unit"
    ),
    "a time of two parts": delay("1h30m", "`h30m` is not expected here", "`1h + 30m`"),
    "a time of a clock": delay("00:05", "`:` is not expected here", "a number with a unit"),
    "a decimal comma": delay("1,5s", "`,` is not expected here", "write a point: `1.5`"),
    "a negative time": delay(
        "-1s", "`-` does not apply to `duration`", "a duration is never negative: remove the sign"
    ),
    "a time that is too fine": delay(
        "0.0001ms", "is not a whole number of ticks of 1ms", "or make the tick finer"
    ),
}

NAMES = {
    "a misspelt constant": delay("T_OPN", "unknown name `T_OPN`", "did you mean `T_OPEN`?"),
    "a misspelt target": target("bb", "there is no state `bb`", "did you mean `b`?"),
    "a target in capitals": target("B", "there is no state `B`", "did you mean `b`?"),
    "a target that is not there": target(
        "opening", "there is no state `opening`", "name a state of this chart"
    ),
    "a target by its path": target("b.d", "there is no state `b.d`", "write `d`"),
    "a target and a state around it": target(
        "b d", "`b` and `d` cannot be entered together", "one target for each region"
    ),
    "an initial state elsewhere": key(
        ("    initial: c", "    initial: a"),
        ('initial="c"', 'initial="a"'),
        "the initial state `a` does not lie in `b`",
        "name a state below `b`",
    ),
    "an event that is not declared": key(
        ("      again: b", "      stop: b"),
        ('event="again" target', 'event="stop" target'),
        "there is no event `stop`",
        "declare `stop` under `events`",
    ),
    "a misspelt event": key(
        ("      again: b", "      agian: b"),
        ('event="again" target', 'event="agian" target'),
        "there is no event `agian`",
        "did you mean `again`?",
    ),
    "two states of one name": key(
        ("      d:\n", "      a:\n"),
        ('<state id="d">', '<state id="a">'),
        "there are two states `a`",
        "rename one of them: ids are unique in a chart, at any depth",
    ),
    "a blank in the name of a state": key(
        ("      d:\n", "      d now:\n"),
        ('<state id="d">', '<state id="d now">'),
        "the id `d now` holds a space",
        "name the state `d_now`",
    ),
    "two declarations of one name": key(
        ("inputs: {temp: 0..1000}", "inputs: {n: 0..1000}"),
        ('fk:input id="temp"', 'fk:input id="n"'),
        "`n` is declared twice",
        "rename one of them",
    ),
    "a base that is not there": key(
        ("doc: A gate.", "doc: A gate.\nextends: guard.yml"),
        ('name="Gate"', 'name="Gate" fk:extends="guard.yml"'),
        "cannot read `guard.yml`: no such file or directory",
        "did you mean `guard.yaml`?",
    ),
    "super without a base": content(
        "super", "`super` represents the base's content, which is missing here", "remove `super`"
    ),
}

TYPES = {
    "a type of C": typed("int", "0", "unknown type `int`", "write `int32`"),
    "a type of SQL": typed("text", "0", "unknown type `text`", "write `symbol`"),
    "a range with a dash": typed("0-9", "0", "unknown type `0-9`", "write `0..9`"),
    "a range backwards": typed("9..0", "0", "the range 9..0 is empty", "write `0..9`"),
    "a start value outside": typed(
        "0..9", "12", "the start value 12 is not within `0..9`", "keep it within 0..9"
    ),
    "a misspelt type": typed("Fautl", "0", "unknown type `Fautl`", "did you mean `Fault`?"),
    "an array without a length": typed("int8[]", "0", "an array has no length", "`int8[4]`"),
    "a value where a type belongs": key(
        ("n: 0..9 = 0", "n: 0"),
        ('fk:type="0..9" expr="0"', 'fk:type="0" expr="0"'),
        "unknown type `0`",
        "a type comes before the start value: `0..255 = 0`",
    ),
    "a Boolean from a number": typed(
        "bool", "1", "the number 1 where `bool` is expected", "write `true`"
    ),
}

EXPRESSIONS = {
    "an assignment in a guard": guard("n = 3", "`=` is not expected here", "compare with `==`"),
    "a word for equality": guard("n is 3", "`is` is not expected here", "compare with `==`"),
    "unequal as in BASIC": guard("n <> 3", "`>` is not expected here", "compare with `!=`"),
    "at least, turned round": guard("n => 3", "`=>` is outside the language", "write `>=`"),
    "a chain of comparisons": guard(
        "0 < n < 5", "a comparison of a comparison", "join two comparisons with `and`"
    ),
    "a number as a condition": guard(
        "n", "`0..9` where `bool` is expected", "write a comparison, such as `!= 0`"
    ),
    "a member as a condition": guard(
        "fault", "`Fault` where `bool` is expected", "compare it with a member: `== Fault.none`"
    ),
    "a misspelt member": guard(
        "fault == Fault.jamm", "`Fault` has no member `jamm`", "did you mean `jam`?"
    ),
    "a member and a number": guard(
        "fault == 1", "`Fault` cannot be compared with the number 1", "or its number: `int(...)`"
    ),
    "a member as a string": guard(
        'fault == "jam"', "`Fault` cannot be compared with a symbol", "such as `Fault.none`"
    ),
    "a field that is not there": guard(
        "event.w > 2", "the event has no field `w`", "its fields are `v`"
    ),
    "a state that is not there": guard(
        "In(nowhere)", "unknown state `nowhere`", "name a state of this chart"
    ),
    "a state as a value": guard("c", "`c` is a state", "test whether it is active: `In(c)`"),
    "an event as a value": guard("go", "`go` is an event, not a value", "let a transition take it"),
    "an operation as a value": guard("motor", "`motor` is an operation", "call it: `motor(...)`"),
    "a list of values": guard("n in [1, 2]", "`in` is outside the language", "with each value"),
    "an operand is missing": guard(
        "n > 2 and", "the expression ends too early", "write the operand that is missing"
    ),
    "a parenthesis is not closed": guard(
        "(n > 2", "the expression ends too early", "close the bracket with `)`"
    ),
    "an index outside": guard(
        "slots[3] > 0", "the index is never within 0..2, the elements of `slots`", "within 0..2"
    ),
    "a field of a record": guard(
        "job.width > 2", "`Job` has no field `width`", "its fields are `size`, `left`"
    ),
    "a time and a number": guard(
        "T_OPEN > 3", "`duration` cannot be compared with the number 3", "give the number a unit"
    ),
    "a Boolean and a number": guard(
        "ok == 1", "`bool` cannot be compared with the number 1", "write it alone, or `not`"
    ),
    "too few arguments": guard(
        "next() > 2", "`next` takes 1 arguments, not 0", "it is declared as `next(i 0..7)`"
    ),
    "no value": guard("n != null", "`null` is outside the language", "has a value from the start"),
    "a division by zero": guard("n / 0 > 1", "the divisor is always 0", "by something else"),
}

STATEMENTS = {
    "a number and a member added": content(
        "n = 100 + fault", "a number and a `Fault` cannot be added", "`int(fault)`"
    ),
    "a comparison as a statement": content("n == 3", "this is not a statement", "assign with `=`"),
    "an assignment of Pascal": content("n := 3", "`:` is not expected here", "assign with `=`"),
    "a comma between statements": content(
        "n = 3, ok = true", "`,` is not expected here", "separate statements with `;`"
    ),
    "nothing between statements": content(
        "n = 3 ok = true", "`ok` is not expected here", "separate statements with `;`"
    ),
    "an input is assigned": content(
        "temp = 3", "`temp` is an input: only the host writes it", "declare it under `data`"
    ),
    "a constant is assigned": content(
        "LIMIT = 3", "`LIMIT` is a constant, and cannot be assigned", "assign data or an output"
    ),
    "a variable that is not declared": content(
        "total = 3", "unknown name `total`", "declare it under `data`"
    ),
    "a value outside": content(
        "n = 12", "the number 12 is never within `0..9`", "keep it within 0..9, or widen the range"
    ),
    "a number in quotes": content(
        'n = "3"', "a symbol where `0..9` is expected", "write the value without quotes"
    ),
    "a Boolean in a number": content(
        "n = ok", "`bool` where `0..9` is expected", "write `1 if ... else 0`"
    ),
    "a record as a whole": content(
        "job = 3", "the number 3 where `Job` is expected", "assign its fields one by one"
    ),
    "a call without parentheses": content("motor", "this is not a statement", "call it: `motor()`"),
    "a misspelt operation": content(
        "moter(1)", "unknown operation `moter`", "did you mean `motor`?"
    ),
    "an argument of another type": content(
        "motor(true)", "`bool` where `-1..1` is expected", "write `1 if ... else 0`"
    ),
    "the result of what returns nothing": content(
        "n = motor(1)", "`motor` returns nothing", "declare its result: `motor(...) -> bool`"
    ),
    "an event as an operation": content(
        "go()", "unknown operation `go`", "write `send go` or `raise go`"
    ),
    "an out event raised": content(
        "raise ready", "`ready` is declared `out` and cannot be raised", "write `send ready`"
    ),
    "a payload that is missing": content(
        "send ready", "event `ready` wants `count`", "write `ready(count = ...)`"
    ),
    "a payload without names": content(
        "send ready(3)", "an argument has no name", "write `name = value`"
    ),
    "a payload of another name": content(
        "send ready(count = 1, total = 2)", "event `ready` has no field `total`", "declare it:"
    ),
    "a send of another tool": content(
        "emit ready(count = 1)", "`ready` is not expected here", "write `send` for `emit`"
    ),
    "a goto": content("goto b", "`goto` is outside the language", "the target in a transition"),
    "an if of Python": content("if n > 2: n = 3", "`{` is missing", "write `if condition { ... }`"),
    "a loop without a bound": content(
        "while n < 3 { n += 1 }", "`while` is outside the language", "iterate over an array"
    ),
    "a block is not closed": content("if n > 2 { n = 3", "`{` is not closed", "close it with `}`"),
    "an answer to nothing": content(
        "reply 3", "`reply` has nothing to answer", "reply in a transition on it"
    ),
}

SYSTEMS = {
    "a key of a chart in a system": line(
        "environment:",
        "events: {in: [x]}\nenvironment:",
        "a system has no key `events`",
        "`events` belongs to a chart (at the left margin)",
    ),
    "connections of another name": line(
        "connect:", "wires:", "a system has no key `wires`", "did you mean `connect`?"
    ),
    "a connection in braces": wire(
        "{gate.ready -> guard[0].came}",
        "a connection is a text: write it without braces",
        "write `- gate.ready -> guard[0].came`",
    ),
    "another arrow": wire(
        "gate.ready => guard[0].came",
        "a connection needs `->`",
        "write `gate.ready -> guard[0].came`",
    ),
    "an arrow backwards": wire(
        "guard[0].came <- gate.ready",
        "a connection needs `->`",
        "write `gate.ready -> guard[0].came`",
    ),
    "a colon for an arrow": wire(
        "gate.ready: guard[0].came",
        "a connection needs `->`, not `:`",
        "write `- gate.ready -> guard[0].came`",
    ),
    "several ends": wire(
        "gate.ready -> guard[0].came, guard[1].came",
        "an end of a connection is `machine.name`",
        "write one connection for each pair of ends",
    ),
    "an array for an element": wire(
        "gate.ready -> guard.came",
        "there is no machine `guard`",
        "write `guard[0]` for one, `guard[i]` for all",
    ),
    "ends swapped": wire(
        "guard[0].came -> gate.ready",
        "no `came` leaves `guard[0]` (it is an event of another direction)",
        "swap the ends",
    ),
    "a payload that does not fit": wire(
        "guard[0].shut -> gate.set",
        "`set` carries (v 0..9), but `shut` gives ()",
        "give both the same fields",
    ),
    "an event to an input": wire(
        "gate.ready -> guard[0].light",
        "no `light` enters `guard[0]` (it is a variable of another kind)",
        "connect an output to an input",
    ),
    "a chart that is not there": line(
        "gate: gate.yaml",
        "gate: gatte.yaml",
        "cannot read `gatte.yaml`: no such file or directory",
        "did you mean `gate.yaml`?",
    ),
    "machines as a list": line(
        'gate: gate.yaml\n  "guard[i in 0..1]": {chart: guard.yaml, with: {NUMBER: i}}',
        "- gate.yaml\n  - guard.yaml",
        "`machines` must be keys with values",
        "for instance `machines: {gate: gate.yaml}`",
    ),
    "the size of an array": line(
        '"guard[i in 0..1]"',
        '"guard[2]"',
        "`guard[2]` is no name for a machine",
        "for several write `guard[i in 0..2]`",
    ),
    "a constant that the chart does not have": line(
        "NUMBER: i", "NUMBR: i", "the chart `Guard` has no constant `NUMBR`", "mean `NUMBER`?"
    ),
    "the file of a machine": line(
        "{chart: guard.yaml", "{file: guard.yaml", "a machine has no key `file`", "mean `chart`?"
    ),
    "an event of no machine": line(
        "may: [gate.set", "may: [set", "there is no machine `set`", "name it under `machines`"
    ),
    "a range with a dash": line(
        "gate.temp in {0, 500}", "gate.temp in 0-500", "a field is given as", "`temp in 0..500`"
    ),
    "a kind of property": line(
        "{never: ",
        "{always: ",
        "there is no kind of property `always`",
        "did you mean `invariant`?",
    ),
    "a state without its machine": never(
        "In(d)", "no machine is named for `d`", "write `gate.In(d)`"
    ),
    "a variable without its machine": never(
        "n > 2", "no machine is named for `n`", "write `gate.n`"
    ),
    "a machine as a value": never(
        "gate", "this is a machine: `gate`", "write `gate.In(state)` or `gate.variable`"
    ),
    "a state as a variable": never(
        "gate.d", "`gate` has no variable `d`", "whether a state is active is written `gate.In(d)`"
    ),
    "a deadline without a time": line(
        "{reachable: gate.In(d)}",
        "{within: [gate.In(c), gate.In(d)]}",
        "`seen` needs two conditions, and a duration between them",
        "for instance `within: [plant.In(hot), 500ms, plant.In(cold)]`",
    ),
}

OTHERS = {
    "tests: a unit": suite("wait 4s", "wait 4sec", f"`sec` {NO_UNIT}", "write `wait 500ms`"),
    "tests: a misspelt event": suite(
        "post set", "post sett", "there is no event `sett`", "did you mean `set`?"
    ),
    "tests: a field of another name": suite(
        "v=3", "w=3", "`v` of `set` is `0..9`: `w=3` is not a valid number", "write `set v=0`"
    ),
    "tests: a state under another key": suite(
        "{in: c}", "{state: c}", "an expectation has no key `state`", "did you mean `in`?"
    ),
    "tests: a step as a key": suite(
        "- wait 4s", "- wait: 4s", "a step is a text", "write `- wait ...`, without a colon"
    ),
    "tests: a misspelt state": suite(
        "{in: c}", "{in: cc}", "there is no state `cc`", "did you mean `c`?"
    ),
    "tests: an input that is assigned": suite(
        "wait 4s", "set temp = 5", "`=` is not a valid number", "write `set temp"
    ),
    "binding: a misspelt operation": binding(
        "motor: motor_turn", "moter: m", "the chart has no operation `moter`", "mean `motor`?"
    ),
    "binding: a statement": binding(
        "adc_read(0)",
        "adc_read(0);",
        "this is not one expression of C: `;` ends a statement",
        "write one expression",
    ),
    "binding: a bracket": binding(
        "motor_turn(speed)", "motor_turn(speed", "this bracket is not closed", "one expression"
    ),
    "binding: the whole directive": binding(
        "[motor.h]",
        '["#include <motor.h>"]',
        "`#include <motor.h>` is not the name of a header",
        "write the name of a header",
    ),
    "project: a misspelt key": project(
        "search =", "serach =", "the project has no key `serach`", "did you mean `search`?"
    ),
    "project: a misspelt rule": project(
        "unread-data",
        "unraed-data",
        "rule `unraed-data` does not exist",
        "did you mean `unread-data`?",
    ),
    "project: a level that is none": project(
        '"off"',
        '"none"',
        "a rule is off, note, warning or error, not `none`",
        '`unread-data = "off"`',
    ),
    "project: a number for a time": project(
        '"60s"', "60", "`timeout` must be a text", 'write `timeout = "30s"`'
    ),
    "project: a text without quotes": project(
        '"off"', "off", "this is not TOML", "put a text in quotes"
    ),
}

MISTAKES = {
    **LAYOUT,
    **KEYS,
    **TIMES,
    **NAMES,
    **TYPES,
    **EXPRESSIONS,
    **STATEMENTS,
    **SYSTEMS,
    **OTHERS,
}

COMMANDS: dict[str, tuple[list[str], int, str, str]] = {
    "a misspelt verb": (["chek", "gate.yaml"], 2, "there is no verb `chek`", "mean `check`?"),
    "a misspelt option": (
        ["check", "gate.yaml", "--timeot", "5s"], 2, "No such option '--timeot'", "'--timeout'",
    ),
    "a target that is none": (
        ["compile", "gate.yaml", "--target", "uml"],
        2,
        "there is no target `uml`: c, ",
        "python, transitions",
    ),
    "a property that is none": (
        ["check", "line.yaml", "--property", "saef"],
        2,
        "`Line` has no property `saef`",
        "did you mean `safe`?",
    ),
    "a limit that is no time": (
        ["check", "gate.yaml", "--timeout", "5x"], 2,
        "`5x` is not a duration", "such as 30s or 10m",
    ),
    "a rule that is none": (
        ["check", "gate.yaml", "--error", "unraed-data"],
        2,
        "rule `unraed-data` does not exist",
        "did you mean `unread-data`?",
    ),
    "a file that is not there": (
        ["check", "gat.yaml"], 1, "cannot read `gat.yaml`", "did you mean `gate.yaml`?",
    ),
    "a folder with nothing": (
        ["check", "empty"],
        1,
        "there is no chart or system in `empty`",
        "a chart is SCXML, or YAML with the key `chart`",
    ),
    "a chart in JSON": (
        ["check", "chart.json"],
        1,
        "charts are YAML or SCXML; a `.json` configures the library `transitions`",
        "has the key `states`",
    ),
    "an event that is called as a word of the script": (
        ["run", "gate.yaml", "--events", "set v=3"],
        1,
        "there is no input `v=3`",
        "to post the event: `post set v=3`",
    ),
    "a binding for a chart": (
        ["check", "--fix", "gate.c.yml"], 1, "cannot read `gate.c.yml`", "mean `gate.c.yaml`?",
    ),
}  # fmt: skip
"""Arguments, exit code, cause, way out."""
