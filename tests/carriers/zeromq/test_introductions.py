"""Who listens: what shows that a node is the one at its endpoint. Python, and C beside it."""

from __future__ import annotations

import ctypes
import random
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

pytest.importorskip("zmq")

from fsmkit.carriers.zeromq.introductions import GONE, HELLO, MARK, Introductions
from tests.runtime.links.conftest import HOSTS, LINKS, ZEROMQ

ROUTE = b"\0abcd"
NO_KEYS = -1


def test_two_nodes_introduce_themselves() -> None:
    a, b = Introductions(0, 2, 7), Introductions(1, 2, 9)
    assert b.receive(a.hello(1), ROUTE, None, 0.0) is None  # it has not heard b yet
    assert a.receive(b.hello(0), ROUTE, None, 0.0) == 1
    assert a.listeners[1].session == 9
    assert b.receive(a.hello(1), ROUTE, None, 0.0) == 0


def test_a_token_shown_for_one_node_does_not_count_for_another() -> None:
    a, b, c = (Introductions(n, 3, 5) for n in range(3))
    c.receive(a.hello(2), ROUTE, None, 0.0)
    token = HELLO.unpack(c.hello(0))[4]
    assert a.receive(HELLO.pack(MARK, 1, 5, 1, token), ROUTE, None, 0.0) is None
    assert a.receive(c.hello(0), ROUTE, None, 0.0) == 2
    b.receive(a.hello(1), ROUTE, None, 0.0)
    assert a.receive(b.hello(0), ROUTE, None, 0.0) == 1


def test_a_key_counts_for_its_own_node_only() -> None:
    a, b = Introductions(0, 3, 7), Introductions(1, 3, 9)
    b.receive(a.hello(1), ROUTE, None, 0.0)
    assert a.receive(b.hello(0), ROUTE, 2, 0.0) is None
    assert a.receive(b.hello(0), ROUTE, -1, 0.0) is None
    assert a.receive(b.hello(0), ROUTE, 1, 0.0) == 1


def test_an_impostor_does_not_disturb_a_peer_that_is_known() -> None:
    a, b = Introductions(0, 2, 7), Introductions(1, 2, 9)
    b.receive(a.hello(1), ROUTE, None, 0.0)
    a.receive(b.hello(0), ROUTE, None, 0.0)
    before = a.hello(1)
    assert a.receive(HELLO.pack(MARK, 1, 10, 3, 4), b"\0zzzz", None, 0.0) is None
    assert a.hello(1) == before
    assert a.listeners[1].route == ROUTE
    a.pass_time(GONE + 0.1)
    assert not a.listeners


@pytest.mark.cc
@pytest.mark.parametrize("seed", range(5))
def test_c_judges_hellos_alike(
    seed: int, tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    """Random hellos, true, forged and damaged; time; and what is said after each."""
    library = tmp_path / "hello.so"
    subprocess.run(
        [
            *(require_tool("gcc"), "-std=c99", "-shared", "-fPIC", "-Wall", "-Wextra", "-Werror"),
            *(f"-I{folder}" for folder in (LINKS, HOSTS)),
            *(str(ZEROMQ / "fsm_link_hello.c"), "-o", str(library)),
        ],
        check=True,
    )
    c = ctypes.CDLL(str(library))
    state = ctypes.create_string_buffer(4096)
    assert c.fsm_link_hello_init(state, 0, 3, 7)
    python = Introductions(0, 3, 7)
    told = ctypes.create_string_buffer(HELLO.size)

    def said(peer: int) -> tuple[int, ...]:
        c.fsm_link_hello_write(state, peer, told)
        return HELLO.unpack(told.raw)

    python.tokens = [said(peer)[3] for peer in range(3)]
    assert len(set(python.tokens)) == 3
    chance = random.Random(seed)
    now, known = 0, 0
    for _ in range(5000):
        node = chance.randrange(4)
        echo = chance.choice((0, chance.randrange(2**64), *python.tokens))
        token = chance.choice((0, chance.randrange(2**64), chance.randrange(2**64)))
        mark = MARK if chance.random() < 0.95 else chance.randrange(256)
        content = HELLO.pack(mark, node, chance.choice((0, 5, 6, 2**32 - 1)), token, echo)
        if chance.random() < 0.05:
            content = chance.choice((content[:-1], content + b"x", b""))
        route = ROUTE if chance.random() < 0.9 else chance.choice((b"abc", b""))
        key = chance.choice((None, None, None, 0, 1, 2, -2))
        now += chance.choice((0, 1, 50, 2500))
        c.fsm_link_hello_pass_time(state, ctypes.c_uint64(now))
        python.pass_time(now / 1000)
        of_c = c.fsm_link_hello_receive(
            *(state, content, ctypes.c_size_t(len(content)), route, ctypes.c_size_t(len(route))),
            *(NO_KEYS if key is None else key, ctypes.c_uint64(now)),
        )
        of_python = python.receive(content, route, key, now / 1000)
        assert of_c == (-1 if of_python is None else of_python)
        assert [said(peer) for peer in (1, 2)] == [
            HELLO.unpack(python.hello(peer)) for peer in (1, 2)
        ]
        known += of_c >= 0
    assert known > 50
