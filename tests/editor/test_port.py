"""`fsmkit lsp` at a port: it prints the port, serves an editor and ends when that is gone."""

from __future__ import annotations

import json
import socket
import subprocess
import sys

import pytest

from fsmkit.cli import execute

INITIALIZE = {
    "jsonrpc": "2.0",
    "id": 1,
    "method": "initialize",
    "params": {"processId": None, "rootUri": None, "capabilities": {}},
}


@pytest.mark.cc
def test_the_port_is_printed_and_an_editor_is_answered_at_it() -> None:
    command = [sys.executable, "-m", "fsmkit", "lsp", "--tcp", "0", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as server:
        assert server.stdout is not None
        try:
            told = "".join(server.stdout.readline().decode() for _ in range(3))
            port = json.loads(told)["port"]
            with socket.create_connection(("127.0.0.1", port)) as editor:
                content = json.dumps(INITIALIZE).encode()
                editor.sendall(b"Content-Length: %d\r\n\r\n%b" % (len(content), content))
                assert editor.recv(15) == b"Content-Length:"
            assert server.wait() == 0
        finally:
            server.kill()


def test_json_without_a_port_is_a_wrong_use(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["lsp", "--json"]) == 2
    assert "--json goes with --tcp" in capsys.readouterr().err
