"""A node as a service: its name, its command and its restart policy."""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

from fsmkit.diagnostics import fail
from fsmkit.emit import plain
from fsmkit.emit.identifiers import Namer, snake
from fsmkit.system.deployment.deployment import Deployment

TEMPLATES = Path(__file__).parent / "templates"
LONGEST_NAME = 100
"""The greatest length of a unit's name; systemd allows 255 with its suffix."""


@dataclass(frozen=True, slots=True)
class Service:
    """A node as the supervisor sees it.

    ``name``: of letters, digits and ``-``; ``group``: that of all nodes of the deployment.
    """

    name: str
    group: str
    system: str
    node: str
    machines: tuple[str, ...]
    command: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Keeping:
    """The restart policy of services: seconds, priorities and processors."""

    watchdog: float = 1.0
    """Seconds without a cycle until a node is restarted; 0: it sends no notices."""
    restart: float = 0.5
    """Seconds from the end of a node to its next start."""
    tries: int = 5
    """Consecutive failed starts after which the node stays down."""
    priority: int = 0
    """The highest SCHED_FIFO priority of the node; 0: none, and no locked memory."""
    cpus: tuple[int, ...] = ()
    """The processors that it may use; empty: all."""
    user: str | None = None


def template(name: str) -> str:
    """Return the text of a template of this package."""
    return (TEMPLATES / name).read_text(encoding="utf-8")


def services_of(
    deployment: Deployment, template: str, node: str | None = None
) -> tuple[Service, ...]:
    """Return the services of a deployment, or that of one node.

    Args:
        deployment: The deployment of the nodes.
        template: The command of a node, in the syntax of a shell; ``{node}`` is replaced by its
            name, ``{health}`` by the address of its health server. The first word is an absolute
            path.
        node: The only node to return; None: all.

    Raises:
        FsmkitError: ``wrong-option`` for a command that no supervisor can start, ``unknown-name``
            for a missing node.

    """
    system = plain(deployment.system.name)
    group = f"fsmkit-{_slug(system)}"
    own = [deployment.nodes[place] for place in deployment.own_nodes]
    if node is not None and node not in own:
        raise fail(
            "unknown-name",
            f"the deployment has no node `{node}` that runs machines of fsmkit",
            help=f"name one of {', '.join(f'`{name}`' for name in own)}",
        )
    names = Namer()
    services = tuple(
        Service(
            f"{group}-{names.name(_slug(name).replace('-', '_')).replace('_', '-')}",
            group,
            system,
            name,
            tuple(
                plain(machine.name)
                for machine, placed in zip(
                    deployment.system.machines, deployment.placed, strict=True
                )
                if placed == place
            ),
            _command(template, name, plain(deployment.health[place]) if deployment.health else ""),
        )
        for place, name in enumerate(deployment.nodes)
        if place in deployment.own_nodes
    )
    return tuple(service for service in services if node in (None, service.node))


def _slug(name: str) -> str:
    """Return a name of a-z, 0-9 and ``-``, which is valid in file and unit names."""
    return re.sub(r"_+", "-", snake(name)).strip("-")[:LONGEST_NAME] or "system"


def _command(template: str, node: str, health: str) -> tuple[str, ...]:
    if "{health}" in template and not health:
        raise fail(
            "wrong-option",
            f"`{{health}}` needs the health address of `{node}`, which is not declared",
            help=f"write in the deployment for instance `health: {{{node}: tcp://127.0.0.1:5601}}`",
        )
    try:
        words = tuple(
            word.replace("{node}", node).replace("{health}", health)
            for word in shlex.split(template)
        )
    except ValueError as error:
        raise fail(
            "wrong-option",
            f"the command `{template}` cannot be divided into words: {error}",
            help="close its quotes",
        ) from error
    if not words or not words[0].startswith("/"):
        raise fail(
            "wrong-option",
            f"the command `{template}` does not start with an absolute path",
            help="write for instance `--exec '/opt/cell/board_{node} --realtime {health}'`",
        )
    if not all(word.isprintable() for word in words):
        raise fail(
            "wrong-option",
            "the command contains unprintable characters",
            help="remove line ends and control characters",
        )
    return words
