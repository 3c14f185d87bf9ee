"""What a target tells by records is shown, printed and converted; each file is read back."""

from __future__ import annotations

import json
import os
import pty
import socket
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from fsmkit.chart.loading import load
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.inspector import charts
from fsmkit.inspector.exports import MessageExporter
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.sources import Entry, Followed
from fsmkit.inspector.sources.live_file import read_live
from fsmkit.inspector.sources.traced import Traced, numberings_of
from fsmkit.plugins import plugins
from fsmkit.runtime import interpreter
from fsmkit.runtime.interpreter import Macrostep
from fsmkit.runtime.script import Player, read_line, run_script, script_texts
from fsmkit.runtime.tracing.framing import encode_frames
from fsmkit.runtime.tracing.reading import Reader
from fsmkit.runtime.tracing.transports import Carrier, Opened, open_endpoint
from fsmkit.runtime.tracing.writing import Writer
from fsmkit.system.of_one_chart import system_of
from tests.inspector.conftest import GATE, Client, elaborated

CHART = elaborated(GATE)
SCRIPT = [
    "start 0", "post open", "run 10", "run 4010", "input blocked 1", "run 4020", "post close",
    "run 5000", "post open", "run 6500", "input blocked 0", "post open", "run 7000",
    "post fault lost", "run 7001",
]  # fmt: skip


def trace_of(script: Sequence[str] = SCRIPT, level: int = 2) -> list[bytes]:
    """Return what a gate tells at each line of a script."""
    player, writer, out = Player(CHART), Writer(CHART, level), list[bytes]()
    for line in script_texts(script):
        read, before = read_line(CHART, line), player.snapshot
        done = [each for each in player.play(line) if isinstance(each, Macrostep)]
        match read.verb:
            case "start":
                out.append(writer.started(before, before.inputs, done[0]))
            case "post":
                out.append(writer.posted(read.event))
            case "run":
                out.append(writer.ran(before, player.now, done))
            case _:
                out.append(b"")
    return out


class Pieces:
    """A source that a test fills."""

    def __init__(self, *pieces: bytes) -> None:
        self.pieces: list[bytes | None] = [*pieces]
        self.is_closed = False

    def read(self) -> bytes | None:
        return self.pieces.pop(0) if self.pieces else b""

    def close(self) -> None:
        self.is_closed = True


def traced(*pieces: bytes, framed: bool = False) -> tuple[Traced, Pieces]:
    source, system = Pieces(*pieces), system_of(CHART)
    reader = Reader(Opened(source, framed), numberings_of(system))
    return Traced(system, reader, ends=True), source


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(charts, "_drawn", lambda *_: ("", "no Graphviz"))  # without Graphviz
    (tmp_path / "gate.yaml").write_text(GATE)
    for level in (1, 2):
        (tmp_path / f"gate{level}.trace").write_bytes(b"".join(trace_of(level=level)))
    return tmp_path


# --- in the page ------------------------------------------------------------------------------


def test_what_a_target_does_is_shown_with_its_data() -> None:
    source, pieces = traced()
    assert isinstance(source, Followed)
    hub = Hub(source)
    client = Client(hub)
    assert client.told[0]["time"] == "live"
    for piece in trace_of():
        pieces.pieces.append(piece)
        hub.advance(16_000)
    steps = [m for m in client.told if m["k"] == "step"]
    assert [step["cause"][0] for step in steps] == [
        "start", "event", "timeout", "event", "event", "event", "event",
    ]  # fmt: skip
    assert steps[-1]["on"] == ["broken"]
    assert client.result("watch", expression="fault_code")["value"] == "lost"
    assert client.result("watch", expression="count")["value"] == 1
    assert client.result("micro", n=steps[1]["n"])[0]["entered"] == ["opening"]
    client.result("back", count=3)
    assert client.last("mode")["mode"] == "frozen"
    for do, given in (("post", {"event": "open"}), ("set", {"input": "blocked", "value": True})):
        assert client.say(do, m="Gate", **given)["k"] == "refused"
    pieces.pieces.append(None)
    hub.advance(16_000)
    source.close()
    assert pieces.is_closed


def test_at_level_1_states_are_shown_and_no_data() -> None:
    source, _ = traced(b"".join(trace_of(level=1)))
    client = Client(Hub(source))
    client.hub.advance(16_000)
    steps = [m for m in client.told if m["k"] == "step"]
    assert [step["cause"] for step in steps[:3]] == [["start"], ["taken", 1], ["taken", 2]]
    assert steps[-1]["on"] == ["broken"]
    assert "value" not in client.result("watch", expression="count")


def test_after_a_loss_nothing_is_known_up_to_the_next_whole_state() -> None:
    pieces = trace_of()
    source, _ = traced(b"".join(pieces[:2]), b"\x71\x05", *pieces[3:])
    entries: list[Entry] = []
    for _ in range(30):
        entries += source.receive()
    kinds = [type(message).__name__ for entry in entries for message in entry.messages]
    lost = kinds.index("Lost")
    again = next(n for n, entry in enumerate(entries) if n > 4 and entry.moment is not None)
    assert entries[-1].moment is not None
    assert all(entry.moment is None for entry in entries[lost - 1 : again])
    assert entries[-1].moment.snapshots[0].configuration == {0, CHART.state_index["broken"]}


def test_where_the_interpreter_parts_from_the_target_it_is_told() -> None:
    data = b"".join(trace_of())
    assert data.count(b"\x8a\x01\x76") == 1
    source, _ = traced(data.replace(b"\x8a\x01\x76", b"\x8a\x04\x76"))
    entries = [entry for _ in range(30) for entry in source.receive()]
    assert source.encoder.parted[0].startswith(
        "Gate at 10: the interpreter does: transition 1 taken"
    )
    assert any(getattr(m, "where", "") == "replay-parts" for e in entries for m in e.messages)


def test_the_end_of_a_connection_is_a_finding() -> None:
    source, pieces = traced()
    pieces.pieces.append(None)
    with pytest.raises(FsmkitError, match="trace-ended"):
        source.receive()


def test_a_flood_is_taken_in_parts() -> None:
    script = ["start 0", *(f"post {'open' if n % 2 else 'close'}" for n in range(5000))]
    source, _ = traced(b"".join(trace_of(script)))
    sizes = [len(source.receive()) for _ in range(60)]
    assert max(sizes) <= 100
    assert sum(sizes) == 5003


def test_what_serve_cannot_attach_is_a_finding(
    files: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    chart = str(files / "gate.yaml")
    assert execute(["serve", chart, "--attach", "tcp:127.0.0.1:1"]) == 1
    assert "trace-ended" in capfd.readouterr().err
    recorded = exported(files, "live")
    assert execute(["serve", str(recorded), "--attach", str(files / "gate2.trace")]) == 2
    assert "--attach takes a chart or a system" in capfd.readouterr().err


# --- lines ------------------------------------------------------------------------------------


def test_lines_are_those_of_a_run(files: Path, capfd: pytest.CaptureFixture[str]) -> None:
    chart, trace = str(files / "gate.yaml"), str(files / "gate2.trace")
    assert execute(["trace", trace, "--charts", chart]) == 0
    lines = capfd.readouterr().out.splitlines()
    kept = [line for line in lines if not line.startswith(("post ", "input ", "@0 ("))]
    own = [line for line in kept if "(all known)" not in line]
    assert own == run_script(CHART, SCRIPT)
    assert execute(["trace", str(files / "gate1.trace"), "--charts", str(files)]) == 0
    lines = capfd.readouterr().out.splitlines()
    assert lines[-4:] == ["@7001 t 3", "- opening", "+ broken", "= broken"]
    assert execute(["trace", trace, "--charts", chart, "--json"]) == 0
    found = json.loads(capfd.readouterr().out)
    assert found["lost_records"] == 0
    assert found["trace"][0] == "@0 (states known) ="


def test_contexts_are_merged(files: Path, capfd: pytest.CaptureFixture[str]) -> None:
    both = [str(files / f"gate{level}.trace") for level in (1, 2)]
    assert execute(["trace", *both, "--charts", str(files / "gate.yaml")]) == 0
    out = capfd.readouterr().out
    times = [int(line[1:].split()[0]) for line in out.splitlines() if line.startswith("@")]
    assert times == sorted(times)
    assert out.count("= broken") >= 2


@pytest.mark.parametrize(
    ("arguments", "rule", "code"),
    [
        (["tpc:1"], "wrong-endpoint", 1),
        (["tcp:nowhere"], "wrong-endpoint", 1),
        (["tcp:localhost:99999"], "wrong-endpoint", 1),
        (["tcp:127.0.0.1:1"], "trace-ended", 1),
        (["serial:/dev/null:115200"], "trace-ended", 1),
        (["serial:/dev/null:17"], "wrong-endpoint", 1),
        (["serial:/nowhere/tty:9600"], "trace-ended", 1),
        (["file:/nowhere"], "trace-ended", 1),
        (["."], "wrong-endpoint", 1),
        (["zmq:nonsense"], "wrong-endpoint", 1),
        (["garbage"], "unreadable-log", 1),
        (["other.trace"], "foreign-trace", 0),
        (["gate2.trace", "--charts", "empty"], "there is no chart", 2),
    ],
    ids=str,
)
def test_bad_input_is_a_finding(
    arguments: list[str], rule: str, code: int, files: Path, monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(files)
    (files / "empty").mkdir()
    (files / "garbage").write_bytes(bytes(range(256)) * 9)
    other = elaborated(GATE.replace("4s", "5s"))
    writer = Writer(other)
    step = interpreter.start(other, 0, Player(other).host)
    whole = writer.started(interpreter.initial(other), step.before.inputs, step)
    (files / "other.trace").write_bytes(whole)
    assert execute(["trace", *arguments]) == code
    assert rule in capfd.readouterr().err


def test_options_that_do_not_go_together(files: Path) -> None:
    assert execute(["trace", str(files / "gate2.trace"), "--to", "vcd"]) == 2
    assert execute(["trace", str(files / "gate2.trace"), "--to", "uml", "--out", "x"]) == 2
    assert execute(["trace"]) == 2


# --- files ------------------------------------------------------------------------------------


def exported(files: Path, name: str, level: int = 2) -> Path:
    target = files / f"out.{name}"
    chart = str(files / "gate.yaml")
    words = ["trace", str(files / f"gate{level}.trace"), "--charts", chart, "--to", name]
    assert execute([*words, "--out", str(target)]) == 0
    return target


def test_all_formats_are_there() -> None:
    assert [each.name for each in plugins(MessageExporter)] == ["live", "mcap", "perfetto", "vcd"]


def test_vcd_is_read_back(files: Path) -> None:
    reader = pytest.importorskip("vcd.reader")
    with exported(files, "vcd").open("rb") as file:
        tokens = list(reader.tokenize(file))
    names = {t.var.id_code: t.var.reference for t in tokens if t.kind is reader.TokenKind.VAR}
    now, seen = 0, []
    for token in tokens:
        if token.kind is reader.TokenKind.CHANGE_TIME:
            now = token.time_change
        elif token.kind is reader.TokenKind.CHANGE_STRING:
            change = token.string_change
            if names[change.id_code] == "state":
                seen.append((now, change.value))
    assert seen == [
        (0, "closed"), (10_000, "opening"), (4_010_000, "wide"), (5_000_000, "closed"),
        (7_000_000, "opening"), (7_001_000, "broken"),
    ]  # fmt: skip
    assert "v_count" in names.values()


HOSTILE = """\
chart: "$end \u202e<script>"
events: {in: ["go(v float64)"]}
data: {ab: uint8 = 0, a_b: float64 = 0.0, state: bool = false}
initial: "]]>"
states:
  "]]>":
    on: {go: {target: "$end", do: [a_b = event.v, state = true]}}
  "$end": {}
"""


@pytest.mark.parametrize("name", ["vcd", "mcap", "perfetto", "live"])
def test_names_are_data(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(charts, "_drawn", lambda *_: ("", "no Graphviz"))
    path = tmp_path / "hostile.yaml"
    path.write_text(HOSTILE, encoding="utf-8")
    chart = load(path)
    player, writer = Player(chart), Writer(chart)
    start = interpreter.start(chart, 0, player.host)
    occurrence = interpreter.Occurrence(chart.event_index["go"], (float("nan"),))
    posted = interpreter.post(chart, start.after, occurrence)
    assert posted is not None
    done = interpreter.run(chart, posted, 5, player.host)
    data = writer.started(interpreter.initial(chart), (), start)
    data += writer.posted(occurrence) + writer.ran(posted, 5, done)
    (tmp_path / "t").write_bytes(data)
    words = ["trace", str(tmp_path / "t"), "--charts", str(path), "--to", name]
    assert execute([*words, "--out", str(tmp_path / "out")]) == 0
    assert (tmp_path / "out").stat().st_size > 100
    if name == "vcd":
        reader = pytest.importorskip("vcd.reader")
        with (tmp_path / "out").open("rb") as file:
            kinds = [token.kind for token in reader.tokenize(file)]
        assert kinds.count(reader.TokenKind.VAR) == 5


def test_mcap_is_read_back(files: Path) -> None:
    reading = pytest.importorskip("mcap.reader")
    with exported(files, "mcap").open("rb") as file:
        found = list(reading.make_reader(file).iter_messages())
    states = [
        (message.log_time, json.loads(message.data)["state"])
        for _, channel, message in found
        if channel.topic == "/Gate/state"
    ]
    assert [state for _, state in states][-2:] == ["opening", "broken"]
    assert states[-1][0] == 7_001_000_000
    assert {channel.topic for _, channel, _ in found} >= {"/Gate/events", "/Gate/values"}
    assert {schema.name for schema, _, _ in found} >= {"fsmkit.State", "fsmkit.Event"}


def test_perfetto_is_read_back(files: Path) -> None:
    protos = pytest.importorskip("perfetto.protos.perfetto.trace.perfetto_trace_pb2")
    trace = protos.Trace()
    trace.ParseFromString(exported(files, "perfetto").read_bytes())
    kinds = protos.TrackEvent.Type
    depth, slices = 0, []
    for packet in trace.packet:
        event = packet.track_event
        if event.type == kinds.Value("TYPE_SLICE_BEGIN"):
            depth += 1
            slices.append((packet.timestamp, event.name))
        elif event.type == kinds.Value("TYPE_SLICE_END"):
            depth -= 1
            assert depth >= 0
    assert depth == 0
    assert slices[-2:] == [(7_000_000_000, "opening"), (7_001_000_000, "broken")]
    names = {p.track_descriptor.name for p in trace.packet if p.HasField("track_descriptor")}
    assert names >= {"Gate", "states", "events"}


@pytest.mark.parametrize("level", [1, 2])
def test_live_is_shown_again(level: int, files: Path) -> None:
    path = exported(files, "live", level)
    recorded, file = read_live(path, Findings(), None)
    assert file == files / "gate.yaml" or file.resolve() == (files / "gate.yaml").resolve()
    client = Client(Hub(recorded))
    client.result("seek", n=len(recorded.entries))
    assert client.last("state")["on"] == ["broken"]


def test_a_package_that_is_missing_is_named(
    files: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    for name, module in (
        ("vcd", "vcd"),
        ("mcap", "mcap.writer"),
        ("perfetto", "perfetto.protos.perfetto.trace"),
    ):
        monkeypatch.setitem(__import__("sys").modules, module, None)
        target = files / f"none.{name}"
        words = ["trace", str(files / "gate2.trace"), "--charts", str(files / "gate.yaml")]
        assert execute([*words, "--to", name, "--out", str(target)]) == 1
        assert "fsmkit[trace]" in capfd.readouterr().err
        assert not target.exists()


# --- carriers ---------------------------------------------------------------------------------


def received(endpoint: str, size: int, *, framed: bool | None = None) -> Iterator[Any]:
    """Read until so many records came."""
    opened = open_endpoint(endpoint)
    reader = Reader(opened, numberings_of(system_of(CHART)), framed=framed)
    count = 0
    while count < size and not reader.is_over:
        for timed in reader.timed():
            count += 1
            yield timed.told
    reader.close()


WHOLE = b"".join(trace_of())


def expected() -> list[Any]:
    reader = Reader(Opened(Pieces(WHOLE, None), framed=False), numberings_of(system_of(CHART)))  # type: ignore[arg-type]
    return [timed.told for _ in range(2) for timed in reader.timed()]


@pytest.mark.parametrize("scheme", ["tcp", "rtt"])
def test_tcp(scheme: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            connection, _ = server.accept()
            with connection:
                connection.sendall(encode_frames(WHOLE) if scheme == "tcp" else WHOLE)

        thread = threading.Thread(target=serve)
        thread.start()
        port = server.getsockname()[1]
        assert list(received(f"{scheme}:127.0.0.1:{port}", 10**6)) == expected()
        thread.join()


def test_serial() -> None:
    ours, theirs = pty.openpty()
    name = os.ttyname(theirs)
    sent = encode_frames(WHOLE)
    wanted = expected()
    found = received(f"serial:{name}:115200", len(wanted))
    opened = open_endpoint(f"serial:{name}:115200")  # sets the line before anything is sent
    os.write(ours, sent)
    opened.source.close()
    assert list(found) == wanted
    os.close(ours)
    os.close(theirs)


def test_zmq() -> None:
    zmq = pytest.importorskip("zmq")
    with zmq.Context() as context, context.socket(zmq.XPUB) as publisher:
        port = publisher.bind_to_random_port("tcp://127.0.0.1")
        opened = open_endpoint(f"zmq:tcp://127.0.0.1:{port}")
        assert publisher.recv() == b"\x01trace"  # it subscribes
        publisher.send_multipart([b"other", b"x"])
        publisher.send_multipart([b"trace", encode_frames(WHOLE)])
        reader = Reader(opened, numberings_of(system_of(CHART)))
        wanted, found = expected(), list[Any]()
        while len(found) < len(wanted):
            found += [timed.told for timed in reader.timed()]
        reader.close()
        assert found == wanted


def test_a_file_tells_itself_whether_it_is_framed(files: Path) -> None:
    (files / "framed").write_bytes(encode_frames(WHOLE))
    for name in ("framed", "gate2.trace"):
        assert list(received(f"file:{files / name}", 10**6)) == expected()


def test_a_file_that_grows_is_read_on(files: Path) -> None:
    path = files / "growing"
    path.write_bytes(WHOLE[:25])
    reader = Reader(open_endpoint(str(path)), numberings_of(system_of(CHART)))
    found = [timed.told for _ in range(3) for timed in reader.timed()]
    assert reader.is_over  # for now, within a record
    with path.open("ab") as file:
        file.write(WHOLE[25:])
    found += [timed.told for _ in range(3) for timed in reader.timed()]
    reader.close()
    assert found == expected()


def test_each_carrier_has_a_form() -> None:
    assert {each.name for each in plugins(Carrier)} == {"file", "rtt", "serial", "tcp", "zmq"}
    assert all(each.form.startswith(f"{each.name}:") for each in plugins(Carrier))
