"""The latencies of messages on the buses of a deployment, for `fsmkit compile`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from fsmkit.carriers.can.dbc import word
from fsmkit.carriers.can.deployment import times_of_buses
from fsmkit.carriers.can.foreign import CanTimes
from fsmkit.system.deployment.deployment import Deployment


def timing_lines(deployment: Deployment) -> Iterator[str]:
    """Yield the worst-case response times of messages on the buses of a deployment."""
    for times in times_of_buses(deployment):
        yield f"{times.node}: bus load {times.load:.1%}; worst-case response times:"
        for message, response in times.responses:
            cycle = f"every {message.cycle} ms" if message.cycle else "without a cycle"
            frame = f"0x{message.frame:x}{'x' if message.is_extended else ''}"
            yield f"  {message.name} ({frame}, {cycle}): {response} us"
        if (silent := _silent_after(deployment, times)) is not None:
            yield f"  a node that hangs is silent at most {silent} us after its last cycle"


def timing_figures(deployment: Deployment) -> Mapping[str, object]:
    """Return the same as data, if there is a bus."""
    found = times_of_buses(deployment)
    if not found:
        return {}
    return {
        "buses": {
            times.node: {
                "load": times.load,
                "silent_us": _silent_after(deployment, times),
                "response_us": {message.name: late for message, late in times.responses},
            }
            for times in found
        }
    }


def _silent_after(deployment: Deployment, times: CanTimes) -> int | None:
    """Return the microseconds from the last cycle of a hanging node to its last message.

    It is the bound of the deployment plus the longest response time of a message with a cycle; None
    if no node of fsmkit sends such a message, or if its response time has no bound.
    """
    foreign = {
        word(machine.chart.name)
        for machine, place in zip(deployment.system.machines, deployment.placed, strict=True)
        if place is not None and deployment.nodes[place] == times.node
    }
    found = [
        response
        for message, response in times.responses
        if message.is_levels and foreign.isdisjoint(map(word, message.senders))
    ]
    late = [response for response in found if response is not None]
    if not found or len(late) < len(found):
        return None
    return 1000 * deployment.watchdog + max(late)
