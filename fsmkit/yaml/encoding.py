"""Decoding of YAML files."""

from __future__ import annotations

from fsmkit.diagnostics import Findings, Source, Span


def decode(content: bytes, name: str, findings: Findings) -> Source | None:
    """Return the text of a YAML file: UTF-8, or UTF-16 with a byte order mark (YAML 1.2, 5.2)."""
    encoding = "utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        return Source(name, content.decode(encoding).replace("\r\n", "\n"))
    except UnicodeDecodeError as error:
        before = content[: error.start].decode(encoding, errors="replace")
        shown = Source(name, before + "\N{REPLACEMENT CHARACTER}")
        findings.add(
            "invalid-encoding",
            f"`{name}` is not valid {encoding.removesuffix('-sig').upper()}",
            Span(shown, len(before), len(before) + 1),
            help="save the file as UTF-8",
        )
        return None
