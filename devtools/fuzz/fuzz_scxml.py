"""Bytes as a chart in SCXML."""

from __future__ import annotations

from collections.abc import Iterator

import atheris

with atheris.instrument_imports(include=["fsmkit"]):
    from devtools.fuzz.fuzzing import fuzz
    from devtools.fuzz.through import through
    from fsmkit.scxml.plugin import PLUGIN

from devtools.fuzz.seeds import charts, strings_of_tests
from devtools.fuzz.xml_mutation import cross, mutate

SEED = """<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
<datamodel><data id="x" expr="0"/><data id="l" expr="[1,2]"/></datamodel><script>x = 1;</script>
<parallel id="p"><onentry><assign location="x" expr="x + 1"/><raise event="e.f"/></onentry>
<state id="a" initial="b"><history id="h" type="deep"><transition target="b"/></history>
<state id="b"><transition event="e.* t" cond="x === 2 &amp;&amp; In('d')" target="c"/>
<onexit><if cond="x&lt;1"><log expr="'n'"/><elseif cond="x"/><send event="t" delay="1s" id="i"/>
<else/><cancel sendid="i"/></if><foreach array="l" item="y"><log label="y" expr="y"/></foreach>
</onexit></state><final id="c"><donedata><param name="q" expr="x"/></donedata></final></state>
<state id="d"><transition event="done.state.a" target="h" type="internal"/>
<invoke type="scxml" src="#x"><finalize/></invoke></state></parallel></scxml>"""
"""Something of everything, small enough to be changed often."""
HEAD = '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">'


def seeds() -> Iterator[str]:
    """Yield charts, and the parts of charts in the tests."""
    yield SEED
    yield from charts(".scxml")
    for text in strings_of_tests():
        if "<scxml" in text:
            yield text
        elif text.strip().startswith(("<state", "<parallel", "<datamodel", "<transition")):
            yield f"{HEAD}{text}</scxml>"


def target(content: bytes) -> None:
    """Take them as far as they go."""
    through(content, "fuzz.scxml", PLUGIN)


if __name__ == "__main__":
    fuzz(target, seeds, mutate, cross)
