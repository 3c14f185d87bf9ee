"""The rules of UPPAAL's files, asked of a file as strangers read it: nothing of fsmkit is used."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from lxml import etree

DTD = Path(__file__).with_suffix(".dtd")
OF_LOCATIONS = {"invariant", "exponentialrate", "comments"}
OF_EDGES = {"select", "guard", "synchronisation", "assignment", "probability", "comments"}
FIRST_LINES = re.compile(
    r"""<\?xml version="1\.0" encoding="utf-8"\?>\n<!DOCTYPE nta PUBLIC '-//Uppaal Team//DTD """
    r"""Flat System 1\.6//EN' 'https?://[^']+/flat-1_6\.dtd'>\n<nta>"""
)


def broken_rules(text: str) -> Iterator[str]:
    """Yield the rules that a file breaks."""
    if not FIRST_LINES.match(text):
        yield "the first lines are not those of the format"
    parser = etree.XMLParser(load_dtd=False, no_network=True, resolve_entities=False)
    root = etree.fromstring(text.encode(), parser)
    dtd = etree.DTD(str(DTD))
    if not dtd.validate(root):
        yield from str(dtd.error_log).splitlines()
    for template in root.iterfind("template"):
        yield from _of_template(template)
    for element in root.iter("label", "system", "name"):
        if not (element.text or "").strip():
            yield f"an empty <{element.tag}>"
    if not re.search(r"(?m)^system \w+(, \w+)*;$", root.findtext("system") or ""):
        yield "no process takes part in the system"


def _of_template(template: etree._Element) -> Iterator[str]:
    own = {location.get("id") for location in template.iterfind("location")}
    for end in template.iter("source", "target", "init"):
        if end.get("ref") not in own:
            yield f"{end.get('ref')} is a location of another template"
    for tag, kinds in (("location", OF_LOCATIONS), ("transition", OF_EDGES)):
        for element in template.iterfind(tag):
            found = [label.get("kind") for label in element.iterfind("label")]
            if len(set(found)) != len(found) or not set(found) <= kinds:
                yield f"labels {found} of a <{tag}>"
