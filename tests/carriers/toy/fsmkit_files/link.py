"""A link of a node by files."""

from __future__ import annotations

from pathlib import Path

from fsmkit.emit import plain
from fsmkit.runtime.links.link import SLOTS, Link, LinkRequest, LinkTimeout


class FileLink(Link):
    """Appends each frame, after its length in two bytes; reads what others have appended."""

    def __init__(self, request: LinkRequest) -> None:
        event_map, folder = request.event_map, Path(request.options["folder"])
        super().__init__(
            event_map, request.node, request.session, request.faults, SLOTS, is_proven=False
        )
        folder.mkdir(parents=True, exist_ok=True)
        files = {place: folder / plain(event_map.nodes[place]) for place in event_map.own_nodes}
        self._own = files.pop(self.node).open("wb", buffering=0)
        self._others = files
        self._taken = dict.fromkeys(files, 0)

    def begin_cycle(self) -> None:
        """Read what others have appended, and see what has come in."""
        for place, file in self._others.items():
            content = file.read_bytes() if file.exists() else b""
            at = self._taken[place]
            while (end := at + 2 + int.from_bytes(content[at : at + 2], "little")) <= len(content):
                self.receiver.arrive(place, content[at + 2 : end])
                at = end
            self._taken[place] = at
        super().begin_cycle()

    def wait_listeners(self, timeout: float) -> None:
        """Raise `LinkTimeout` where a node has no file."""
        for file in self._others.values():
            if not file.exists():
                raise LinkTimeout(f"waited {timeout} s for `{file.name}` to listen")

    def close(self) -> None:
        """Close the file of the node."""
        super().close()
        self._own.close()

    def _wake(self) -> None:
        while (frame := self.next_frame()) is not None:
            self._own.write(len(frame).to_bytes(2, "little") + frame)

    def _take_in(self, node: int, timeout: float) -> bool:  # noqa: ARG002  (a cycle reads frames)
        return False
