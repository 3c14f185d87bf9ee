"""Plug-in protocols for the files that carriers add to a deployment."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, runtime_checkable

from fsmkit.plugins import plugins

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    from fsmkit.codegen.system.node import Node
    from fsmkit.diagnostics import FsmkitError
    from fsmkit.system.board import Board
    from fsmkit.system.deployment.deployment import Deployment


@runtime_checkable
class CLibrary(Protocol):
    """A plug-in with C that programs of nodes compile."""

    name: str
    library: Path
    """The folder of the C, which `fsmkit paths` prints."""


@runtime_checkable
class DeploymentFiles(Protocol):
    """Adds files to a deployment that names this carrier, for its links or a foreign node."""

    name: str

    def files(self, deployment: Deployment) -> Mapping[str, str]:
        """Return the files that all nodes share, by path: descriptions of messages, for tools."""
        ...

    def node_files(self, node: Node) -> Mapping[str, str]:
        """Return the C files of a node beside its machines, by path: tables of its messages."""
        ...

    def rejection(self, deployment: Deployment, target: str) -> FsmkitError | None:
        """Return why a target cannot generate the deployment, or None."""
        ...


@runtime_checkable
class TimingReport(Protocol):
    """Reports the delay of messages over a carrier."""

    name: str

    def timing_lines(self, deployment: Deployment) -> Iterable[str]:
        """Yield the lines that `fsmkit compile` prints."""
        ...

    def timing_figures(self, deployment: Deployment) -> Mapping[str, object]:
        """Return the same as data, by the keys of the JSON document."""
        ...


@runtime_checkable
class DeploymentPackage(Protocol):
    """Packs the C of a deployment in the layout of another build system."""

    name: str
    package: str
    """The kind of package, as ``--package`` names it."""

    def packed(
        self,
        deployment: Deployment,
        machines: Mapping[str, Mapping[str, str]],
        nodes: Sequence[Node],
    ) -> Mapping[str, str]:
        """Return the files; ``machines``: by node the C of its machines, and the joining C.

        Raises `FsmkitError` if the package cannot hold the deployment.
        """
        ...


@runtime_checkable
class BoardFiles(Protocol):
    """Generates the C of boards: a plug-in that is a `BoardKind`, too."""

    name: str

    def board_files(self, board: Board) -> Mapping[str, str]:
        """Return the files, by path."""
        ...


def files_of(deployment: Deployment) -> tuple[DeploymentFiles, ...]:
    """Return the file plug-ins of a deployment: its carriers, in order of name."""
    return tuple(each for each in plugins(DeploymentFiles) if each.name in deployment.carriers)


def timing_of(deployment: Deployment) -> tuple[TimingReport, ...]:
    """Return the timing plug-ins of a deployment: its carriers, in order of name."""
    return tuple(each for each in plugins(TimingReport) if each.name in deployment.carriers)


def packages() -> dict[str, DeploymentPackage]:
    """Return the packing plug-ins, by the kind of package."""
    return {each.package: each for each in plugins(DeploymentPackage)}
