"""A configuration of supervisord, for computers without systemd.

It is a file for the ``[include]`` of the user's own configuration. Source: supervisord.org,
"Configuration File". There is no watchdog, and limits are those of supervisord itself.

supervisord restarts a program in the next pass of its loop, which waits up to 1 s for input
(``Supervisor.runforever``). No setting shortens the wait. Therefore another program of the group
prints an empty line regularly, which is not stored. Each line starts a pass.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from fsmkit.codegen.units.service import Keeping, Service, template
from fsmkit.emit import printing
from fsmkit.emit.template import Fields, filled
from fsmkit.emit.units import supervised_text, supervised_word

PASS = 0.1
"""Seconds from one pass of supervisord's loop to the next."""
WAKER = ".waker"
"""The suffix of the program that starts the passes; names of nodes contain no dot."""


@printing
def supervisor_files(services: Sequence[Service], keeping: Keeping) -> dict[str, str]:
    """Return one file by name: a program for each service, a waker, and their group."""
    group = services[0].group
    waker = f"{group}{WAKER}"
    user = [f"user={supervised_text(keeping.user)}"] if keeping.user else []
    head: Fields = {
        "group": group,
        "system": supervised_text(services[0].system),
        "programs": ",".join([*(service.name for service in services), waker]),
        "waker": waker,
        "waking": f"{supervised_word('/bin/sh')} -c {supervised_word(_waking())}",
        "user": user,
    }
    programs: list[Fields] = [
        {
            "node": supervised_text(service.node),
            "machines": supervised_text(", ".join(service.machines)),
            "name": service.name,
            "command": " ".join(map(supervised_word, _command(service, keeping))),
            "seconds": str(max(1, math.ceil(keeping.restart))),
            "tries": str(keeping.tries),
            "user": user,
        }
        for service in services
    ]
    program = template("program.conf")
    texts = [filled(template("group.conf"), head), *(filled(program, each) for each in programs)]
    return {f"{group}.conf": "".join(texts)}


def _waking() -> str:
    """Return the command of the waker, which ends when its lines are no longer read."""
    return f"while echo && sleep {PASS:g}; do :; done"


def _command(service: Service, keeping: Keeping) -> tuple[str, ...]:
    """Return the command, with processors set by taskset(1), as supervisord has no key for them."""
    if not keeping.cpus:
        return service.command
    return ("taskset", "--cpu-list", ",".join(map(str, keeping.cpus)), *service.command)
