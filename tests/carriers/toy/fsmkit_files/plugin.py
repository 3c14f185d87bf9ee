"""Links by files: each node appends its frames to a file of its own, which the others read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fsmkit.diagnostics import Findings, fail
from fsmkit.document.keys import Keys, named
from fsmkit.runtime.links.link import Link, LinkRequest
from fsmkit.system.deployment.carrier import DeploymentRequest


@dataclass(frozen=True)
class FileNetwork:
    """The folder of the files, as a deployment names it."""

    folder: Path
    carrier: str = "files"


class Files:
    """Reads `links: {kind: files, folder: ...}` and opens links by files."""

    name = "files"
    link_keys: Keys = named(folder="the folder with a file for each node")
    required_keys: Mapping[str, str] = {"folder": "/run/cell"}
    options: tuple[str, ...] = ("folder",)

    def read(self, request: DeploymentRequest, findings: Findings) -> FileNetwork | None:
        """Return the folder; None after an error."""
        text = request.options["folder"]
        if "~" in text.value:
            findings.add("broken-deployment", f"`{text}` names a home", text, help="write a path")
            return None
        return FileNetwork(request.folder / text.value)

    def link_options(self, deployment: Any) -> dict[str, Any]:
        """Return the folder, if the deployment has links of this kind."""
        network = deployment.network
        return {"folder": network.folder} if isinstance(network, FileNetwork) else {}

    def open(self, request: LinkRequest) -> Link:
        """Return the link of a node."""
        from .link import FileLink

        if "folder" not in request.options:
            raise fail("link-not-opened", "links by files need a folder", help="name a `folder`")
        return FileLink(request)


PLUGIN = Files()
