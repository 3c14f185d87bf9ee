"""Units of systemd: a service for each node, and a target for all of them.

Source: systemd.service(5), systemd.exec(5), systemd.unit(5).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fsmkit.codegen.units.service import Keeping, Service, template
from fsmkit.emit import printing
from fsmkit.emit.template import Fields, filled
from fsmkit.emit.units import unit_text, unit_word

WINDOW = 2.0
"""The interval of systemd's start limit, as a multiple of the duration of the starts."""


@printing
def systemd_files(services: Sequence[Service], keeping: Keeping) -> dict[str, str]:
    """Return the units by file name; the services belong to one deployment."""
    group = services[0].group
    target: Fields = {
        "system": unit_text(services[0].system),
        "wants": [f"Wants={service.name}.service" for service in services],
    }
    return {
        **{f"{service.name}.service": _service(service, keeping) for service in services},
        f"{group}.target": filled(template("nodes.target"), target),
    }


def _service(service: Service, keeping: Keeping) -> str:
    window = max(10.0, WINDOW * keeping.tries * (keeping.restart + keeping.watchdog))
    fields: Fields = {
        "node": unit_text(service.node),
        "system": unit_text(service.system),
        "machines": unit_text(", ".join(service.machines)),
        "group": service.group,
        "window": f"{window:g}",
        "tries": str(keeping.tries),
        "notices": _notices(keeping),
        "command": " ".join(map(unit_word, service.command)),
        "restart": f"{keeping.restart:g}",
        "user": [f"User={unit_text(keeping.user)}"] if keeping.user else [],
        "rights": list(_rights(keeping)),
    }
    return filled(template("node.service"), fields)


def _notices(keeping: Keeping) -> Sequence[str]:
    """Return the service type: a node is ready once it has received from all others.

    The time that this takes is not limited.
    """
    if keeping.watchdog == 0:
        return ("Type=exec",)
    return ("Type=notify", "TimeoutStartSec=infinity", f"WatchdogSec={keeping.watchdog:g}")


def _rights(keeping: Keeping) -> Iterable[str]:
    if keeping.priority:
        yield f"LimitRTPRIO={keeping.priority}"
        yield "LimitMEMLOCK=infinity"
    if keeping.cpus:
        yield f"CPUAffinity={' '.join(map(str, keeping.cpus))}"
