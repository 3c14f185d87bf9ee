"""Frames as they come, whole, in pieces, and wrong."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from fsmkit.inspector.dap import framing
from fsmkit.inspector.dap.adapter import OF_ADAPTER, OF_INSPECTION, OF_SESSION, Adapter
from fsmkit.inspector.dap.framing import BrokenFrameError, Frames, decode_body, frame
from tests.inspector.dap.editor import Editor, Json

VALUES: st.SearchStrategy[Any] = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**63) | st.text() | st.floats(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)


@pytest.mark.slow
@settings(max_examples=40)
@given(st.lists(st.dictionaries(st.text(), st.text() | st.integers())), st.integers(1, 40))
def test_messages_come_through_in_any_pieces(messages: list[Json], size: int) -> None:
    text = b"".join(map(frame, messages))
    assert text.isascii()
    frames = Frames()
    pieces = [text[start : start + size] for start in range(0, len(text), size)]
    assert [decode_body(body) for piece in pieces for body in frames.feed(piece)] == messages


@pytest.mark.parametrize(
    "head",
    [
        b"GET / HTTP/1.1\r\n",
        b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 2\r\n\r\n{}",
        b"Content-Length: -1\r\n\r\n",
        b"Content-Length: 1_0\r\n\r\n",
        b"Content-Length: %d\r\n\r\n" % (framing.MOST_BYTES + 1),
        b"Content-Length: 2\r\nContent-Length: 2\r\n\r\n{}",
        b"Content-Type: application/json\r\n\r\n",
        b"\r\n\r\n",
        b"x" * framing.MOST_HEADER,
        b"Content-Type: " + b"x" * framing.MOST_HEADER,
        b"\x00\xff" * 600,
    ],
)
def test_what_is_no_header_is_refused(head: bytes) -> None:
    with pytest.raises(BrokenFrameError):
        list(Frames().feed(head))


def test_headers_are_read_in_any_case_and_order() -> None:
    text = b"content-type: application/vscode-jsonrpc; charset=utf-8\r\ncontent-length: 2\r\n\r\n{}"
    assert list(Frames().feed(text)) == [b"{}"]


# --- whatever comes is answered or closed --------------------------------------------------------


class Talk:
    """An adapter under bytes of any kind."""

    def __init__(self) -> None:
        self.told: list[Json] = []
        self.adapter = Adapter(self.told.append)
        self.frames = Frames()

    def hear(self, data: bytes) -> None:
        try:
            for body in self.frames.feed(data):
                self.adapter.receive(body)
        except BrokenFrameError as error:
            self.adapter.broken(str(error))


@settings(max_examples=60)
@given(st.lists(st.binary(max_size=80), max_size=6))
def test_any_bytes_end_a_conversation_or_are_waited_for(chunks: list[bytes]) -> None:
    talk = Talk()
    for chunk in chunks:
        talk.hear(chunk)
        if talk.adapter.is_over:
            assert talk.told[-1]["event"] == "terminated"
            break
    assert all(not message.get("success") for message in talk.told)


@given(st.binary(max_size=200))
@example(b"[" * 100_000)
@example(b'{"seq":1,"type":"request","command":"initialize","arguments":[]}')
@example(b'{"seq":1e999,"type":"request","command":"x"}')
def test_any_body_is_answered_or_no_request(body: bytes) -> None:
    talk = Talk()
    talk.hear(b"Content-Length: %d\r\n\r\n%s" % (len(body), body))
    assert [message["success"] for message in talk.told] in ([False], [True])


COMMANDS = st.sampled_from(sorted({*OF_ADAPTER, *OF_SESSION, *OF_INSPECTION, "", "cancel"}))
KEYS = st.sampled_from(
    [
        *("threadId", "frameId", "variablesReference", "source", "breakpoints", "filters"),
        *("name", "value", "expression", "context", "text", "column", "line", "program"),
        *("granularity", "sourceReference", "startFrame", "levels", "start", "count", "endLine"),
        *("seed", "cwd", "replace", "speed"),
    ]
)


@settings(max_examples=20)
@given(st.lists(st.tuples(COMMANDS, st.dictionaries(KEYS, VALUES, max_size=4)), max_size=6))
def test_any_request_before_a_session_is_answered_once(asked: list[tuple[str, Json]]) -> None:
    editor = Editor()
    for command, arguments in asked:
        count = editor.answers(command, arguments)
        assert count == (not editor.adapter.is_over or command == "disconnect")
        if editor.adapter.is_over:
            break
