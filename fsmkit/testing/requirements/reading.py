"""Read files of requirements; their content decides which format they have."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from fsmkit.chart.loading import read_bytes
from fsmkit.diagnostics import Findings, fail
from fsmkit.testing.requirements import csv_table, doorstop, needs, reqif
from fsmkit.testing.requirements.requirement import Requirement, as_broken, merge
from fsmkit.yaml.encoding import decode

ZIP = (b"PK\x03\x04", b"PK\x05\x06")


def read_requirements(paths: Iterable[Path], findings: Findings) -> Mapping[str, Requirement]:
    """Return the requirements of files by id.

    Args:
        paths: CSV, ReqIF (`.reqif`, `.reqifz`), `needs.json`, or folders of Doorstop.
        findings: Receives the ids that several requirements have.

    Raises:
        FsmkitError: ``broken-requirements`` or ``unreadable-file``, with the location.

    """
    return merge((read_file(path) for path in paths), findings)


def chosen_requirements(
    requirements: Mapping[str, Requirement], where: Iterable[tuple[str, str]]
) -> Mapping[str, Requirement]:
    """Return the requirements that have all these values in these columns, ignoring case.

    Raises `FsmkitError` (``wrong-option``) if no requirement has such a column.
    """
    wanted = {(name.lower(), value.lower()) for name, value in where}
    known = {name.lower() for one in requirements.values() for name, _ in one.columns}
    for name, _ in wanted:
        if name not in known:
            raise fail(
                "wrong-option",
                f"no requirement has a column `{name}`",
                help=f"use one of {', '.join(sorted(known))}" if known else "leave --where out",
            )
    return {
        id_: one
        for id_, one in requirements.items()
        if wanted <= {(name.lower(), value.lower()) for name, value in one.columns}
    }


def read_file(path: Path) -> tuple[Requirement, ...]:
    """Return the requirements of a file or a folder; raises `FsmkitError`."""
    if path.is_dir():
        return doorstop.read_folder(path)
    content = read_bytes(path)
    if content.startswith(ZIP) or path.suffix.lower() == ".reqifz":
        return reqif.read_archive(content, str(path))
    start = content[:1000].lstrip(b"\xef\xbb\xbf\xff\xfe\0 \t\r\n")
    if start.startswith(b"<"):
        return reqif.read(content, str(path))
    findings = Findings()
    source = decode(content, str(path), findings)
    if source is None:
        raise as_broken(findings, "file of requirements")
    if start.startswith((b"{", b"[")):
        return needs.read(source)
    return csv_table.read(source)
