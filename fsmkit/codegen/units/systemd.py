"""Units of systemd: a service for each node, and a target for all of them.

Source: systemd.service(5), systemd.exec(5), systemd.unit(5).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fsmkit.codegen.units.service import Keeping, Service
from fsmkit.emit import printing
from fsmkit.emit.units import unit_text, unit_word

WINDOW = 2.0
"""The limit of starts is counted over so many times the seconds that the starts take."""


@printing
def systemd_files(services: Sequence[Service], keeping: Keeping) -> dict[str, str]:
    """Return the units by file name; the services belong to one deployment."""
    group, system = services[0].group, unit_text(services[0].system)
    target = _sections(
        Unit=(
            f"Description=The nodes of {system} that run here",
            *(f"Wants={service.name}.service" for service in services),
        ),
        Install=("WantedBy=multi-user.target",),
    )
    return {
        **{f"{service.name}.service": _service(service, keeping) for service in services},
        f"{group}.target": target,
    }


def _service(service: Service, keeping: Keeping) -> str:
    machines = unit_text(", ".join(service.machines))
    node, system = unit_text(service.node), unit_text(service.system)
    window = max(10.0, WINDOW * keeping.tries * (keeping.restart + keeping.watchdog))
    return _sections(
        Unit=(
            f"Description=Node {node} of {system}: {machines}",
            f"PartOf={service.group}.target",
            "After=network.target",
            f"StartLimitIntervalSec={window:g}",
            f"StartLimitBurst={keeping.tries}",
        ),
        Service=(
            *_notices(keeping),
            f"ExecStart={' '.join(map(unit_word, service.command))}",
            "Restart=on-failure",
            f"RestartSec={keeping.restart:g}",
            *((f"User={unit_text(keeping.user)}",) if keeping.user else ()),
            *_rights(keeping),
        ),
        Install=(f"WantedBy={service.group}.target",),
    )


def _notices(keeping: Keeping) -> Iterable[str]:
    """Until a node has heard the others it is not ready: however long that takes is no failure."""
    if keeping.watchdog == 0:
        return ("Type=exec",)
    return ("Type=notify", "TimeoutStartSec=infinity", f"WatchdogSec={keeping.watchdog:g}")


def _rights(keeping: Keeping) -> Iterable[str]:
    if keeping.priority:
        yield f"LimitRTPRIO={keeping.priority}"
        yield "LimitMEMLOCK=infinity"
    if keeping.cpus:
        yield f"CPUAffinity={' '.join(map(str, keeping.cpus))}"


def _sections(**sections: Iterable[str]) -> str:
    return "\n".join("\n".join((f"[{name}]", *lines, "")) for name, lines in sections.items())
