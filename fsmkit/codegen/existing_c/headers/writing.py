"""Formats a proposal as a binding file, with the unused declarations in comments."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fsmkit.codegen.existing_c.headers.propose import Offer, Proposal
from fsmkit.emit.lines import one_line
from fsmkit.yaml.layout import quoted

MOST_OFFERS = 40
"""The number of header declarations without a use in the chart, beyond which they are cut."""
PLAIN = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.-")
WIDTH = 130


def binding_text(
    chart: str,
    file: str,
    includes: Sequence[str],
    proposal: Proposal,
    offered: Sequence[Offer] = (),
    rejected: Sequence[str] = (),
) -> str:
    """Return the text of a binding.

    Args:
        chart: The name of the chart.
        file: Its file, relative to the binding.
        includes: The headers, as the compiler finds them.
        proposal: The entries, and remarks.
        offered: Possible declarations for the chart, as comments.
        rejected: The reasons why structs are not offered, as comments.

    """
    lines = [f"binding: {_scalar(chart)}", f"chart: {_scalar(file)}"]
    lines.append(f"include: [{', '.join(map(_scalar, includes))}]")
    lines.append("# context: {type: struct board, member: machine}      # `ctx` in expressions")
    remarks = proposal.remarks
    lines += _table("constants", proposal.constants, remarks)
    types = [
        f"  {_scalar(name)}: {{type: {_scalar(type_)}, {key}: {{{_flow(parts)}}}}}"
        for key, found in (("members", proposal.enumerations), ("fields", proposal.records))
        for name, (type_, parts) in found.items()
    ]
    lines += _section("types", types, remarks)
    for key, found in (
        ("operations", proposal.operations),
        ("sends", proposal.sends),
        ("inputs", proposal.inputs),
    ):
        lines += _table(key, found, remarks)
    outputs = {
        name: f"{{set: {_scalar(text)}}}" if is_call else _scalar(text)
        for name, (text, is_call) in proposal.outputs.items()
    }
    written = [f"  {_scalar(name)}: {text}" for name, text in outputs.items()]
    lines += _section("outputs", written, remarks)
    lines += _offers(offered, rejected)
    return "\n".join(lines) + "\n"


def _table(key: str, entries: dict[str, str], remarks: dict[str, list[str]]) -> list[str]:
    written = [f"  {_scalar(name)}: {_scalar(text)}" for name, text in entries.items()]
    return _section(key, written, remarks)


def _section(key: str, written: list[str], remarks: dict[str, list[str]]) -> list[str]:
    told = [f"# {key}: {one_line(text)}" for text in remarks.get(key, ())]
    return [*([f"{key}:", *written] if written else ()), *told]


def _offers(offered: Sequence[Offer], rejected: Iterable[str]) -> list[str]:
    lines = []
    if offered:
        lines.append("# The header has, and the chart could declare:")
        lines += [f"#   {each.key}: {_short(each.line)}" for each in offered[:MOST_OFFERS]]
        if len(offered) > MOST_OFFERS:
            lines.append(f"#   and {len(offered) - MOST_OFFERS} more")
    structs = [f"#   {_short(each)}" for each in rejected]
    if structs:
        lines += ["# Not offered:", *structs[:MOST_OFFERS]]
        if len(structs) > MOST_OFFERS:
            lines.append(f"#   and {len(structs) - MOST_OFFERS} more")
    return lines


def _short(text: str) -> str:
    text = one_line(text)
    return text if len(text) <= WIDTH else f"{text[: WIDTH - 4]} ..."


def _flow(entries: dict[str, str]) -> str:
    return ", ".join(f"{_scalar(name)}: {_scalar(text)}" for name, text in entries.items())


def _scalar(text: str) -> str:
    """Return a YAML scalar, quoted unless it is a plain word."""
    words = text.split(" ")
    is_plain = all(word and set(word) <= PLAIN for word in words) and text[0] not in "-."
    return text if is_plain else quoted(text)
