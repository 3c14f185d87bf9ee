"""Packed texts are as a list of them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fsmkit.inspector.packed_strings import TOGETHER, Texts

TEXT = st.binary(max_size=5).map(lambda text: text.replace(b"\n", b""))
DOING = st.one_of(
    st.tuples(st.just("append"), st.integers(0, 3 * TOGETHER)),
    st.tuples(st.just("forget"), st.integers(0, 2 * TOGETHER)),
    st.tuples(st.just("first"), st.integers(0, 5 * TOGETHER)),
)


@given(st.lists(st.tuples(DOING, TEXT), max_size=12))
def test_packed_texts_are_as_a_list(doing: list[tuple[tuple[str, int], bytes]]) -> None:
    texts, plain = Texts([b""]), [b""]
    for (what, most), text in doing:
        count = most if what == "append" else min(most, len(plain))
        if what == "append":
            for n in range(count):
                texts.append(text + b"%d" % n)
                plain.append(text + b"%d" % n)
        elif what == "forget":
            texts.forget(count)
            del plain[:count]
        else:
            whole, texts, plain = list(plain), texts.first(count), plain[:count]
            assert whole[:count] == plain
        assert list(texts) == plain
        assert len(texts) == len(plain)
        assert texts.size >= 0
    with pytest.raises(IndexError):
        texts[len(plain)]


def test_many_alike_take_little() -> None:
    texts = Texts(b'{"k":"step","m":"Gate","n":%d,"at":%d,"do":[]}' % (n, n) for n in range(10_000))
    assert texts.size < 20 * len(texts)
    before = texts.size
    texts.forget(5_000)
    assert texts.size < 0.6 * before
