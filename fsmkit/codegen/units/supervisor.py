"""A configuration of supervisord, for computers without systemd.

It is a file for the ``[include]`` of the user's own configuration. Source: supervisord.org,
"Configuration File". There is no watchdog, and limits are those of supervisord itself.

supervisord starts what has ended in the next pass of its loop, which waits up to 1 s for something
to read (``Supervisor.runforever``); no setting shortens it. So one more program of the group prints
an empty line now and then, which nobody keeps, and each line begins a pass.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from fsmkit.codegen.units.service import Keeping, Service
from fsmkit.emit import printing
from fsmkit.emit.units import supervised_text, supervised_word

PASS = 0.1
"""Seconds from one pass of supervisord's loop to the next."""
WAKER = ".waker"
"""Ends the name of the program that begins them; names of nodes have no dot."""


@printing
def supervisor_files(services: Sequence[Service], keeping: Keeping) -> dict[str, str]:
    """Return one file by name: a program for each service, a waker, and a group of all of them."""
    group, system = services[0].group, supervised_text(services[0].system)
    waker = f"{group}{WAKER}"
    lines = [
        f"; The nodes of {system}. Name this file under [include] in supervisord.conf.",
        f"[group:{group}]",
        f"programs={','.join([*(service.name for service in services), waker])}",
        "",
        "; Its lines wake supervisord, which else starts a node that has ended up to 1 s later.",
        f"[program:{waker}]",
        f"command={supervised_word('/bin/sh')} -c {supervised_word(_waking())}",
        "autostart=true",
        "autorestart=true",
        "stopsignal=TERM",
        "stdout_logfile=NONE",
        "stderr_logfile=NONE",
        *((f"user={supervised_text(keeping.user)}",) if keeping.user else ()),
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


def _waking() -> str:
    """Return the command of the waker: it ends when nobody reads its lines any more."""
    return f"while echo && sleep {PASS:g}; do :; done"


def _command(service: Service, keeping: Keeping) -> tuple[str, ...]:
    """Return the command, with processors set by taskset(1), as supervisord has no key for them."""
    if not keeping.cpus:
        return service.command
    return ("taskset", "--cpu-list", ",".join(map(str, keeping.cpus)), *service.command)
