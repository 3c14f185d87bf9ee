"""Charts of any size: one region, regions side by side, and regions of very different sizes."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from fsmkit.chart.chart import Chart
from fsmkit.document.document import Direction

HEAD = (
    '<scxml xmlns="http://www.w3.org/2005/07/scxml" xmlns:fk="urn:fsmkit:scxml" version="1.0"'
    ' datamodel="ecmascript" name="Sized"><datamodel><data id="n" expr="0" fk:type="0..9"/>'
    "</datamodel>"
)


def flat(count: int) -> str:
    """Return a chart of states beside each other, each with two transitions, some with content."""
    lines = [HEAD]
    for place in range(count):
        content = f"<onentry><assign location='n' expr='{place % 10}'/></onentry>"
        lines.append(
            f"<state id='s{place}'>{content if place % 100 == 1 else ''}"
            f"<transition event='go' target='s{(place + 1) % count}'/>"
            f"<transition event='far' cond='n !== 3' target='s{(place * 7 + 3) % count}'/></state>"
        )
    return "\n".join([*lines, "</scxml>"])


def sparse(count: int) -> str:
    """Return a chart of states beside each other, each with a transition on one of many events."""
    lines = [HEAD]
    for place in range(count):
        event = "go" if place % 2 else f"e{place % 40}"
        content = f"<assign location='n' expr='{place % 10}'/>" if place % 7 == 0 else ""
        lines.append(
            f"<state id='s{place}'><transition event='{event}' cond='n &lt; 8'"
            f" target='s{(place + 1) % count}'>{content}</transition>"
            f"<transition event='far' target='s{(place * 7 + 3) % count}'/></state>"
        )
    return "\n".join([*lines, "</scxml>"])


def parallel(count: int) -> str:
    """Return a chart of regions of two states: 3 states for each, with 1 around all."""
    lines = [HEAD, "<parallel id='all'>"]
    for region in range(max(1, (count - 1) // 3)):
        to = f"<transition event='go' target='b{region}'/>"
        from_ = f"<transition event='turn' target='a{region}'/>"
        back = f"<transition event='go' target='a{region}'/>{from_ if region % 2 else ''}"
        lines.append(f"<state id='r{region}'><state id='a{region}'>{to}</state>")
        lines.append(f"<state id='b{region}'>{back}</state></state>")
    # what is left: one more region
    left = (count - 1) % 3
    lines += [f"<state id='l{place}'/>" for place in range(left)]
    return "\n".join([*lines, "</parallel></scxml>"])


def uneven(count: int) -> str:
    """Return a chart of one large region between two small ones, with a deep history of all."""
    lines = [HEAD, "<state id='in' initial='all'><transition event='turn' target='out'/>"]
    lines += ["<history id='was' type='deep'><transition target='all'/></history>"]
    lines += ["<parallel id='all'>", SMALL.format(name="x"), "<state id='large'>"]
    inside = max(2, count - 11)
    for place in range(inside):
        lines.append(
            f"<state id='s{place}'><transition event='go' target='s{(place + 1) % inside}'/>"
            f"<transition event='far' target='s{(place * 7 + 3) % inside}'/></state>"
        )
    lines += ["</state>", SMALL.format(name="y"), "</parallel></state>"]
    lines += ["<state id='out'><transition event='turn' target='was'/></state>"]
    return "\n".join([*lines, "</scxml>"])


SMALL = (
    "<state id='{name}'><state id='{name}a'><transition event='go' target='{name}b'/></state>"
    "<state id='{name}b'><transition event='far' target='{name}a'/></state></state>"
)
KINDS: dict[str, Callable[[int], str]] = {
    "flat": flat,
    "sparse": sparse,
    "parallel": parallel,
    "uneven": uneven,
}


def script(chart: Chart) -> Sequence[str]:
    """Return what a host does with such a chart: some events, each with time to react."""
    names = [event.name for event in chart.events if Direction.IN in event.directions]
    steps = 6 if "all" in {state.id for state in chart.states} else 24
    lines = ["start 0"]
    for step in range(steps):
        name = names[(step * step + step // 3) % len(names)]
        lines += [f"post {name}", f"run {step + 1}"]
    return (*lines, "dump")
