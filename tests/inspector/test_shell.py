"""`fsmkit run` on a terminal: lines do what the hub does, and wrong ones are findings."""

from __future__ import annotations

import asyncio
import io
import os
import pty
import re
import select
import sys
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from prompt_toolkit.application import create_app_session
from prompt_toolkit.history import InMemoryHistory
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.output import DummyOutput

import fsmkit
from fsmkit.cli import execute
from fsmkit.diagnostics import Diagnostic, FsmkitError
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.shell.completion import candidates
from fsmkit.inspector.shell.outline import bottom_line
from fsmkit.inspector.shell.prompt import Serving, converse, history_of
from fsmkit.inspector.shell.shell import COMMANDS, MOST_SHOWN, Shell
from tests.inspector.conftest import GATE, Client, elaborated

CELL = Path(__file__).parents[2] / "machines/production_cell/cell.yaml"
CLOCK = """\
chart: Clock
data: {n: 0..60000 = 0}
initial: on
states:
  on: {every: {10ms: {do: n = n + 1}}}
"""
COMMANDING = """\
chart: Odd
events: {in: [set(v 0..9), go, "wait"]}
data: {n: 0..9 = 0}
initial: a
states:
  a: {on: {set: {do: n = event.v}, go: b}}
  b: {}
"""


class Typing:
    """A shell, what it printed, and what it wrote."""

    def __init__(self, model: Any, file: Path | None = None, **options: Any) -> None:
        self.printed: list[str] = []
        self.written: dict[Path, str] = {}
        self.shell = Shell(
            show=lambda line: self.printed.append(str(line)),
            write=self.written.__setitem__,
            serve=self._serve,
            **options,
        )
        self.hub = Hub(model, file=file, observer=self.shell.observe)
        self.shell.attach(self.hub)

    async def _serve(self, hub: Hub) -> str:
        assert hub is self.hub
        return "http://127.0.0.1:1/#token"

    def type(self, *lines: str) -> list[str]:
        """Type lines; return what was printed since."""
        self.printed.clear()
        for line in lines:
            asyncio.run(self.shell.obey(line))
        return self.printed

    def refused(self, line: str) -> Diagnostic:
        """Return the finding about a line."""
        with pytest.raises(FsmkitError) as raised:
            self.type(line)
        return raised.value.diagnostics[0]

    @property
    def state(self) -> str:
        """The line below the prompt."""
        return bottom_line(self.hub)


@pytest.fixture
def gate_shell(gate: Path) -> Typing:
    return Typing(fsmkit.read_chart(gate), gate)


def test_steps_are_printed_as_by_run(
    gate: Path, gate_shell: Typing, capsys: pytest.CaptureFixture[str]
) -> None:
    first = list(gate_shell.printed)
    found = [*first, *gate_shell.type("open", "wait 4s", "close", "post open")]
    execute(["run", str(gate), "--events", "open; wait 4s; close; post open"])
    assert found == capsys.readouterr().out.splitlines()


def test_lines_of_a_trace_are_printed_as_by_run(
    gate: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    typing = Typing(fsmkit.read_chart(gate), gate, lines_only=True)
    first = list(typing.printed)
    found = [*first, *typing.type("set blocked true", "open", "set blocked false", "open")]
    events = "set blocked true; open; set blocked false; open"
    execute(["run", str(gate), "--events", events, "--trace"])
    assert found == capsys.readouterr().out.splitlines()


def test_the_state_stands_below_the_line(gate_shell: Typing) -> None:
    assert gate_shell.state == "0ms | closed | no timer"
    gate_shell.type("open", "wait 1500ms")
    assert gate_shell.state == "1.5s | opening | opening: after 4s in 2.5s"
    assert gate_shell.type("state") == [
        "    closed", "  * opening", "    wide", "    broken",
    ]  # fmt: skip


def test_undo_takes_back_time_as_well(gate_shell: Typing) -> None:
    gate_shell.type("open", "wait 1s", "fault code=jam")
    broken = gate_shell.state
    assert "broken" in broken
    gate_shell.type("undo")
    assert gate_shell.state == "1s | opening | opening: after 4s in 3s"
    gate_shell.type("undo 2")
    assert gate_shell.state == "0ms | closed | no timer"
    assert gate_shell.type("undo") == ["nothing to undo"]
    gate_shell.type("redo 3")
    assert gate_shell.state == broken
    assert gate_shell.type("redo") == ["nothing to redo"]


def test_what_was_undone_is_a_branch(gate_shell: Typing) -> None:
    gate_shell.type("open", "undo", "set blocked true")
    assert "closed" in gate_shell.state
    told = gate_shell.type("fork")
    other = re.match(r" +(\d+): to entry", told[1])
    assert other is not None
    gate_shell.type(f"fork {other[1]}")
    assert "opening" in gate_shell.state
    assert gate_shell.refused("fork 77").message == "there is no branch 77"


def test_a_breakpoint_stops(gate_shell: Typing) -> None:
    gate_shell.type("break if count == 1", "open")
    assert gate_shell.type("wait 10s")[-1] == "breakpoint 1: if count == 1"
    assert gate_shell.state.startswith("4s | wide")
    assert gate_shell.type("break entered closed if count == 1", "break") == [
        "  1: if count == 1", "  2: entered closed if count == 1",
    ]  # fmt: skip
    assert gate_shell.type("close")[-1].startswith("breakpoint 2")
    assert gate_shell.type("unbreak 1", "unbreak 2", "break") == []


@pytest.mark.parametrize(
    "line",
    [
        *("break left closed", "break event open", "break taken 1", "break sent opened"),
        *("break changed motor", "break fault", "break error", "break lost"),
    ],
)
def test_kinds_of_breakpoints(gate_shell: Typing, line: str) -> None:
    gate_shell.type(line)
    hit = "breakpoint 1" in " ".join(gate_shell.type("open", "wait 4s"))
    assert hit == (line not in ("break fault", "break error", "break lost"))


def test_go_runs_until_a_condition_or_the_end(gate_shell: Typing) -> None:
    gate_shell.type("open")
    assert gate_shell.type("go until In(wide)")[-1] == "In(wide) holds"
    assert gate_shell.type("go")[-1] == "no timer is armed"
    assert gate_shell.type("step") == ["no timer is armed"]
    gate_shell.type("close", "open", "timer")
    assert gate_shell.state.startswith("8s | wide")


def test_control_c_stops_what_runs() -> None:
    typing = Typing(elaborated(CLOCK))

    def stop(*_: object) -> None:
        if typing.hub.at > 5_000:
            typing.shell.is_interrupted = True

    typing.hub.join(stop)
    told = typing.type("go")
    assert told[-1] == "interrupted"
    assert not typing.hub.is_running
    typing.type("wait 100s")
    assert typing.hub.at < 100_000


def test_of_many_steps_the_first_and_the_last_are_printed() -> None:
    typing = Typing(elaborated(CLOCK))
    told = typing.type("wait 30s")
    first = next(n for n, line in enumerate(told) if "steps more" in line)
    assert "... 2790 steps more ..." in told[first]
    assert sum("every 10ms" in line and line.startswith(" ") for line in told[:first]) >= MOST_SHOWN
    assert told[-1].strip() == "= on"
    assert any(line.startswith("     30s") for line in told[first:])


def test_why_and_watch(gate_shell: Typing) -> None:
    gate_shell.type("set blocked true")
    told = gate_shell.type("why open")
    assert told[0] == "open would do nothing"
    assert "closed [not blocked] does not hold: blocked is true" in told[1]
    assert re.search(r"gate\.yaml:\d+$", told[1])
    assert gate_shell.type("why close")[1] == "  no active state has a transition for it"
    gate_shell.type("set blocked false", "open")
    assert gate_shell.type("why fault code=none")[0] == "fault would do nothing"
    assert gate_shell.type("why fault code=jam")[0] == "fault would be taken"
    assert gate_shell.type("watch count + 3") == ["3"]
    assert gate_shell.type("watch fault_code == Fault.none") == ["true"]


def test_an_event_with_the_name_of_a_command_is_posted() -> None:
    typing = Typing(elaborated(COMMANDING))
    typing.type("post set v=3")
    assert typing.type("watch n") == ["3"]
    assert typing.type("go") == ["no timer is armed"]
    typing.type("post go")
    assert "| b |" in typing.state


def test_what_was_done_is_saved_as_a_test_that_passes(gate_shell: Typing) -> None:
    told = gate_shell.type("open", "wait 4s", "save as test jam", "save as script jam.txt")
    assert told[-2:] == ["jam_test.py is written", "jam.txt is written"]
    found: dict[str, Any] = {}
    exec(gate_shell.written[Path("jam_test.py")], found)
    found["test_it_does_so_again"]()
    assert gate_shell.written[Path("jam.txt")].splitlines()[-1] == "run 4000"


@pytest.mark.parametrize(
    ("line", "message", "help_"),
    [
        ("opne", "no event and no command `opne`", "`open`"),
        ("undoo", "no event and no command `undoo`", "`undo`"),
        ("undo x", "a number is wanted", "undo [N]"),
        ("undo -1", "a number is wanted", "undo [N]"),
        ("set blockd true", "no input `blockd`", "`blocked`"),
        ("set blocked", "an input and its value", "set INPUT VALUE"),
        ("set blocked maybe", "neither `true` nor `false`", ""),
        ("set blocked true false", "one word too many", ""),
        ("fault code=jamm", "not a member of `Fault`", ""),
        ("fault", "needs a value", ""),
        ("open 3", "does not take `3`", ""),
        ("wait", "the time to wait", "wait 500ms"),
        ("wait soon", "the time to wait", "wait 500ms"),
        ("go until", "a condition is wanted", "go until"),
        ("go until In(wid)", "wid", "`wide`"),
        ("go until count", "bool", ""),
        ("break on x", "no breakpoint on `on`", ""),
        ("break entered wid", "no state `wid`", "`wide`"),
        ("break entered", "one name is wanted", ""),
        ("break taken x", "is not a transition", ""),
        ("break taken 99", "no transition 99", ""),
        ("break if", "", ""),
        ("why", "no event is named", ""),
        ("why opne", "no event `opne`", "`open`"),
        ("watch", "an expression is wanted", ""),
        ("watch cuont", "cuont", "`count`"),
        ("unbreak 9", "no breakpoint 9", ""),
        ("save", "nothing is saved", "save as test NAME"),
        ("state of affairs", "one word too many", "state"),
        ("post", "no event is named", "post EVENT"),
        ("\x1b[2J", "no event and no command", ""),
        ("[ ] ,", "", ""),
    ],
)
def test_a_wrong_line_is_a_finding_and_changes_nothing(
    gate_shell: Typing, line: str, message: str, help_: str
) -> None:
    before = gate_shell.state, gate_shell.hub.n
    finding = gate_shell.refused(line)
    assert message in finding.message
    assert help_ in (finding.help or "")
    assert (gate_shell.state, gate_shell.hub.n) == before


def test_machines_of_a_system_are_named() -> None:
    typing = Typing(fsmkit.read_system(CELL))
    assert typing.state.count(": ") >= 3
    told = typing.type("plant.press_start")
    assert any(line.startswith("plant") for line in told)
    assert typing.type("watch feeder.In(pushing)") in (["true"], ["false"])
    assert "there is no event" in typing.refused("plant.press_strat").message
    assert "`plant.press_start`" in (typing.refused("plant.press_strat").help or "")
    assert typing.type("break entered feeder.error", "break") == ["  1: entered feeder.error"]
    assert "molder" in typing.type("state")


def test_help_has_each_command(gate_shell: Typing) -> None:
    text = "\n".join(gate_shell.type("help"))
    assert all(usage in text for usage, _ in COMMANDS.values())
    assert gate_shell.type("serve") == ["http://127.0.0.1:1/#token"]
    gate_shell.type("exit")
    assert gate_shell.shell.is_done


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("op", {"open"}),
        ("un", {"undo", "unbreak"}),
        ("post f", {"fault"}),
        ("fault ", {"code="}),
        ("fault code=", {"none", "jam", "lost"}),
        ("fault code=l", {"lost"}),
        ("fault code=lost ", set()),
        ("post fault code=j", {"jam"}),
        ("set ", {"blocked"}),
        ("set blocked t", {"true"}),
        ("break en", {"entered"}),
        ("break entered o", {"opening"}),
        ("break entered opening ", {"if"}),
        ("break if co", {"count"}),
        ("break event open if fau", {"fault_code"}),
        ("go ", {"until"}),
        ("go until In(w", {"wide"}),
        ("go until fault_code == Fault.", {"Fault.none", "Fault.jam", "Fault.lost"}),
        ("watch T", {"T_OPEN"}),
        ("save as ", {"test", "script", "messages"}),
        ("why cl", {"close"}),
        ("nonsense ", set()),
    ],
)
def test_completion(gate_shell: Typing, text: str, expected: set[str]) -> None:
    assert {word for word, _ in candidates(gate_shell.shell.names, text)} == expected


def test_steps_of_others_are_printed_and_their_stops(gate_shell: Typing) -> None:
    gate_shell.type("break if In(opening)")
    gate_shell.printed.clear()
    changes: list[None] = []
    gate_shell.shell.on_change = lambda: changes.append(None)
    Client(gate_shell.hub).say("post", m="Gate", event="open")
    assert "          + opening" in gate_shell.printed
    assert gate_shell.printed[-1] == "breakpoint 1: if In(opening)"
    assert changes


# --- terminals --------------------------------------------------------------------------------


def test_keys_complete_recall_and_leave(gate: Path, tmp_path: Path) -> None:
    typing = Typing(fsmkit.read_chart(gate), gate)
    found: list[Diagnostic] = []
    history = history_of({"XDG_STATE_HOME": str(tmp_path)}.get)

    async def session(keys: str) -> None:
        with create_pipe_input() as pipe, create_app_session(input=pipe, output=DummyOutput()):
            for key in keys:
                pipe.send_text(key)
            await asyncio.wait_for(converse(typing.shell, found.extend, history), 10)

    asyncio.run(session("open\rset blokced true\rab\x03wait 1s\r\x04"))
    assert typing.state.startswith("1s | opening")
    assert [each.rule.name for each in found] == ["wrong-script-line"]
    kept = (tmp_path / "fsmkit/run_history").read_text(encoding="utf-8")
    assert "+open\n" in kept
    asyncio.run(session("\x1b[A\r\x04"))  # the last line again
    assert typing.state.startswith("2s | opening")


def test_where_no_history_can_be_kept_it_is_in_memory(tmp_path: Path) -> None:
    (tmp_path / "fsmkit").write_text("a file")
    assert isinstance(history_of({"XDG_STATE_HOME": str(tmp_path)}.get), InMemoryHistory)


def test_a_page_of_the_session_is_served(gate: Path) -> None:
    hub = Hub(fsmkit.read_chart(gate))

    async def session() -> tuple[str, str, bytes]:
        serving = Serving()
        one, other = await serving.serve(hub), await serving.serve(hub)
        port = int(one.split(":")[2].partition("/")[0])
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode())
        line = await reader.readline()
        writer.close()
        await serving.close()
        return one, other, line

    one, other, line = asyncio.run(session())
    assert one == other
    assert b"200" in line


def test_a_pipe_is_read_as_before(
    gate: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO("open\nwait 4s\nstate\n"))
    assert execute(["run", str(gate)]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "= wide"


class Terminal:
    """A program on a pseudo-terminal."""

    def __init__(self, arguments: Iterable[str], folder: Path) -> None:
        self.text = ""
        self._pid, self._file = pty.fork()
        if not self._pid:
            os.chdir(folder)
            state = folder / "state"  # beside the charts a folder `fsmkit` would hide the package
            os.environ |= {"XDG_STATE_HOME": str(state), "TERM": "xterm", "COLUMNS": "100"}
            os.execv(sys.executable, [sys.executable, "-m", "fsmkit", *arguments])

    def waits(self, text: str) -> None:
        """Read until a text comes."""
        end = time.monotonic() + 30
        while text not in self.text:
            assert time.monotonic() < end, self.text
            assert self._read(), self.text

    def _read(self) -> bool:
        """Read what is there; False at the end."""
        if not select.select([self._file], [], [], 0.1)[0]:
            return True
        try:
            read = os.read(self._file, 65536)
        except OSError:  # how Linux says that the other side is closed
            return False
        if b"\x1b[6n" in read:  # where is the cursor?
            os.write(self._file, b"\x1b[1;1R")
        self.text += re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", read.decode(errors="replace"))
        return bool(read)

    def type(self, keys: str, *until: str) -> None:
        """Press keys; read until texts come, one after the other."""
        self.text = ""
        os.write(self._file, keys.encode())
        for text in until:
            self.waits(text)
            self.text = self.text.partition(text)[2]

    def close(self) -> int:
        """Leave; return the exit code."""
        os.write(self._file, b"\x04")
        while self._read():
            pass
        return os.waitstatus_to_exitcode(os.waitpid(self._pid, 0)[1])


@pytest.mark.cc
@pytest.mark.slow
def test_on_a_terminal(tmp_path: Path) -> None:
    (tmp_path / "clock.yaml").write_text(CLOCK, encoding="utf-8")
    (tmp_path / "gate.yaml").write_text(GATE, encoding="utf-8")
    terminal = Terminal(["run", "gate.yaml"], tmp_path)
    terminal.waits("no timer")
    terminal.type("op\t", "open")
    terminal.type("\r", "opening: after 4s in 4s")
    terminal.type("opne\r", "did you mean `open`?", "| opening |")
    terminal.type("save as test gate\r", "gate_test.py is written", "| opening |")
    terminal.type("save as test gate\r", "is there already", "| opening |")
    assert terminal.close() == 0
    terminal = Terminal(["run", "clock.yaml"], tmp_path)
    terminal.waits("every 10ms in")
    terminal.type("go\r", "every 10ms   clock.yaml:5")
    terminal.type("\x03", "interrupted", "| on |")
    assert terminal.close() == 0
