"""A configuration of supervisord, for computers without systemd.

It is a file for the ``[include]`` of the user's own configuration. Source: supervisord.org,
"Configuration File". There is no watchdog, and limits are those of supervisord itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from fsmkit.codegen.units.service import Keeping, Service
from fsmkit.texts import printing
from fsmkit.texts.units import supervised_text, supervised_word


@printing
def supervisor_files(services: Sequence[Service], keeping: Keeping) -> dict[str, str]:
    """Return one file by name, with a program for each service and a group of all of them."""
    group, system = services[0].group, supervised_text(services[0].system)
    lines = [
        f"; The nodes of {system}. Name this file under [include] in supervisord.conf.",
        f"[group:{group}]",
        f"programs={','.join(service.name for service in services)}",
    ]
    for service in services:
        machines = supervised_text(", ".join(service.machines))
        lines += [
            "",
            f"; Node {supervised_text(service.node)}: {machines}",
            f"[program:{service.name}]",
            f"command={' '.join(map(supervised_word, _command(service, keeping)))}",
            "autostart=true",
            "autorestart=unexpected",
            f"startsecs={max(1, math.ceil(keeping.restart))}",
            f"startretries={keeping.tries}",
            "stopsignal=TERM",
            "stopwaitsecs=5",
            *((f"user={supervised_text(keeping.user)}",) if keeping.user else ()),
        ]
    return {f"{group}.conf": "\n".join([*lines, ""])}


def _command(service: Service, keeping: Keeping) -> tuple[str, ...]:
    """Return the command, with processors set by taskset(1), as supervisord has no key for them."""
    if not keeping.cpus:
        return service.command
    return ("taskset", "--cpu-list", ",".join(map(str, keeping.cpus)), *service.command)
