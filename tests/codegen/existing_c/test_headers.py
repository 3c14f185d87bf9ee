"""``fsmkit bind``: headers of C, read as a compiler reads them; nothing is guessed."""

from __future__ import annotations

import builtins
import json
import mmap
import shutil
from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path

import pytest

from fsmkit.cli import execute
from fsmkit.codegen.existing_c.headers import parsing
from fsmkit.codegen.existing_c.headers.folders import Compiler, compiler_of
from fsmkit.codegen.existing_c.headers.model import Header
from fsmkit.codegen.existing_c.headers.parsing import read_header
from fsmkit.codegen.existing_c.headers.words import alike, likeness, words
from fsmkit.diagnostics import FsmkitError
from tests.needs import need

EXAMPLE = Path(__file__).parents[3] / "fsmkit/cli/examples/charger"
RequireTool = Callable[[str], str]
pytestmark = pytest.mark.cc

HEADER = """\
#include <stdint.h>
#define COUNT 42
#define NEGATIVE (-7L)
#define WIDE 0xFFFFFFFFFFFFFFFFull
#define CHAINED (COUNT + SHIFT(2))
#define SHIFT(x) (1 << (x))
#define EMPTY
#define TEXT "text"
#define HALF 0.5
#define OPEN {
#define CLOSE }
#define BROKEN ) + (
#define UNKNOWN (no_such_name)
#define WHERE ((int *)0)
#define CAST ((uint8_t)300)
#define IN_ENUM GREEN
enum colour { RED = -1, GREEN, BLUE = 7 };
typedef enum { ONE = 1 } number;
typedef struct { uint8_t a; int16_t b[3]; unsigned c : 3; int d : 4; _Bool e; double f; } plain;
struct tagged { enum colour c; };
struct pointing { int *p; };
struct flexible { int n; int rest[]; };
struct holding { union { int a; float b; } u; };
struct nested { struct tagged t; };
struct hidden { struct { int x; }; };
typedef struct incomplete incomplete;
extern int16_t level;
extern const int fixed;
int add(int a, uint8_t b);
void say(const char *text, ...);
static inline int twice(int x) { return 2 * x; }
"""


@pytest.fixture
def reading(require_tool: RequireTool, tmp_path: Path) -> Callable[[str], Header]:
    """Return a reader of header texts."""
    need(find_spec("clang") is not None, "libclang")
    compiler = compiler_of([require_tool("cc")], [])

    def read(text: str) -> Header:
        path = tmp_path / "some.h"
        path.write_text(text, encoding="utf-8")
        return read_header(path, compiler, [])

    return read


def test_a_process_with_much_address_space_reads_headers(reading: Callable[[str], Header]) -> None:
    """The runtime of WebAssembly, which draws without Graphviz, reserves hundreds of GiB."""
    with mmap.mmap(-1, 64 << 30, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS, prot=mmap.PROT_READ):
        assert [each.name for each in reading("void beep(void);\n").functions] == ["beep"]


def test_what_a_header_declares(reading: Callable[[str], Header]) -> None:
    found = reading(HEADER)
    own = {each.name: each.value for each in found.constants if each.is_own}
    assert own == {
        "COUNT": 42, "NEGATIVE": -7, "WIDE": 2**64 - 1, "CHAINED": 46, "CAST": 44, "IN_ENUM": 0,
        "RED": -1, "GREEN": 0, "BLUE": 7, "ONE": 1,
    }  # fmt: skip
    assert {each.name for each in found.enumerations if each.is_own} == {"enum colour", "number"}
    refused = {each.name: each.rejection for each in found.structs if each.is_own}
    assert {name for name, why in refused.items() if not why} == {"plain", "struct tagged"}
    assert set(refused) > {"struct pointing", "struct flexible", "struct holding", "struct nested"}
    assert "int *" in refused["struct pointing"]
    (plain,) = (each for each in found.structs if each.name == "plain")
    assert [(m.name, m.type.lo, m.type.hi, m.count) for m in plain.members] == [
        ("a", 0, 255, 0), ("b", -32768, 32767, 3), ("c", 0, 7, 0), ("d", -8, 7, 0),
        ("e", 0, 1, 0), ("f", 0, 0, 0),
    ]  # fmt: skip
    functions = {each.name: each for each in found.functions if each.is_own}
    assert set(functions) == {"level", "fixed", "add", "say", "twice"}
    assert functions["level"].is_variable
    assert functions["fixed"].is_constant
    assert [each.spelling for each in functions["say"].parameters] == ["const char *", "..."]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("uint32_t x;", "unknown type name"),
        ("#include <no_such_header.h>\n", "file not found"),
        ("int f(", "expected"),
        ("#error no device\n", "no device"),
        ("\0\1\2", "expected"),
    ],
)
def test_after_an_error_nothing_is_read(
    text: str, message: str, reading: Callable[[str], Header]
) -> None:
    with pytest.raises(FsmkitError) as caught:
        reading(text)
    (found,) = caught.value.diagnostics
    assert found.rule.name == "header-not-read"
    assert message in found.message
    assert found.help is not None


@pytest.mark.parametrize("command", [["false"], ["/no/such/compiler"], ["echo", "hello"]])
def test_what_is_no_compiler_is_told(command: list[str]) -> None:
    with pytest.raises(FsmkitError) as caught:
        compiler_of(command, [])
    assert caught.value.diagnostics[0].rule.name == "header-not-read"


def test_without_libclang_there_is_a_way_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = builtins.__import__

    def without(
        name: str,
        globals: Mapping[str, object] | None = None,  # noqa: A002
        locals: Mapping[str, object] | None = None,  # noqa: A002
        fromlist: Sequence[str] | None = (),
        level: int = 0,
    ) -> object:
        if name.partition(".")[0] == "clang":
            raise ImportError(name)
        return real(name, globals, locals, fromlist or (), level)

    monkeypatch.setattr(builtins, "__import__", without)
    path = tmp_path / "a.h"
    path.write_text("int x;\n")
    with pytest.raises(FsmkitError) as caught:
        read_header(path, Compiler(("/usr/include",), ""), [])
    (found,) = caught.value.diagnostics
    assert found.rule.name == "missing-package"
    assert "fsmkit[headers]" in str(found.help)


def test_names_are_alike_by_their_words() -> None:
    assert words("BMS_AmpsMax2") == ("bms", "amps", "max", "2")
    assert likeness("AMPS_MAX", "ampsMax") > likeness("AMPS_MAX", "BMS_AMPS_MAX")
    assert likeness("AMPS_MAX", "BMS_AMPS_MAX") > likeness("AMPS_MAX", "AMPS_MAX_DC")
    assert likeness("AMPS_MAX", "BMS_AMPS_MAX_DC") > 0
    assert likeness("MAX_AMPS", "BMS_AMPS_MAX") == 0
    assert alike("hot", ["BMS_HOT", "GPU_HOT", "cold"], str) == ["BMS_HOT", "GPU_HOT"]
    assert alike("---", ["BMS_HOT"], str) == []


# --- the verb -------------------------------------------------------------------------------------


@pytest.fixture
def folder(tmp_path: Path, require_tool: RequireTool, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the example without its binding."""
    require_tool("cc")
    need(find_spec("clang") is not None, "libclang")
    monkeypatch.delenv("CC", raising=False)
    copy = shutil.copytree(EXAMPLE, tmp_path / "charger")
    (copy / "charger.c.yaml").unlink()
    return copy


def bind(folder: Path, *arguments: str, header: str = "vendor/bms.h") -> int:
    chart = str(folder / "charger.yaml")
    return execute(["bind", str(folder / header), "--chart", chart, *arguments])


def test_a_proposal_is_a_binding(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert bind(folder) == 0
    printed = capsys.readouterr().out
    for line in (
        "  AMPS_MAX: BMS_AMPS_MAX\n",
        "  TEMP_MAX: BMS_TEMP_MAX_DC\n",
        "  Fault: {type: bms_status, members: {none: BMS_OK, hot: BMS_HOT, lost: BMS_LOST}}\n",
        "  Sample: {type: bms_frame, fields: {amps: amps, temp: temp_dc}}\n",
        "#   types: bms_channel: [BMS_CHANNEL_1 = 1, BMS_CHANNEL_2]\n",
    ):
        assert line in printed
    assert bind(folder, "--write") == 0
    assert (folder / "charger.c.yaml").exists()
    assert execute(["compile", str(folder / "charger.yaml"), "--out", str(folder / "out")]) == 0
    assert (folder / "out/charger_bind.c").exists()
    assert bind(folder, "--write") == 1  # it is not overwritten
    assert "there is a binding already" in capsys.readouterr().err


def test_what_differs_is_a_remark(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = folder / "vendor/bms.h"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("320u", "300u").replace("BMS_HOT,", "BMS_HOT = 4,"))
    assert bind(folder) == 0
    printed = capsys.readouterr().out
    assert "# constants: AMPS_MAX is 320, and `BMS_AMPS_MAX` is 300" in printed
    assert "bms_status" not in printed.partition("# The header has")[0]


def test_calls_and_variables_are_bound_where_all_fits(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "board.h").write_text(
        "#include <stdint.h>\n#include <stdbool.h>\n"
        "void board_set_current(uint16_t amps);\nbool board_healthy(void);\n"
        "void board_show(const char *text);\nint16_t board_temp(void);\nextern uint16_t amps;\n"
        "void pwm_level(uint8_t value);\nvoid led_relay(bool on);\nvoid fan_relay(bool on);\n"
        "void on_charged(void);\n"
    )
    assert bind(folder, header="board.h") == 0
    printed = capsys.readouterr().out
    for line in (
        '  set_current: "board_set_current(amps)"\n',
        '  healthy: "board_healthy()"\n',
        '  charged: "on_charged()"\n',
        '  temp: "board_temp()"\n',
        "  amps: amps\n",
        '  level: {set: "pwm_level(value)"}\n',
        "# operations: show: `void board_show(const char *)` has other arguments\n",
        "# outputs: relay: `led_relay`, `fan_relay`\n",
    ):
        assert line in printed, line


def test_options_of_the_build_count(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = folder / "deep/inner/device.h"
    path.parent.mkdir(parents=True)
    path.write_text(
        '#ifndef DEVICE\n#error which device\n#endif\n#include "bms.h"\n#define AMPS_MAX DEVICE\n'
    )
    options = (f"-I{folder / 'deep'}", "-I", str(folder / "vendor"), "-DDEVICE=320")
    assert bind(folder, "--json", header="deep/inner/device.h") == 1
    assert "which device" in json.loads(capsys.readouterr().out)["findings"][0]["message"]
    assert bind(folder, "--json", "--", *options, header="deep/inner/device.h") == 0
    found = json.loads(capsys.readouterr().out)
    assert 'include: ["inner/device.h"]' in found["binding"]
    assert "AMPS_MAX: AMPS_MAX" in found["binding"]
    assert found["bound"] == 4


def test_names_that_the_machine_will_have_are_told(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "board.h").write_text(
        "#define CHARGER_AMPS_MAX 320\nvoid charger_show(int n);\nvoid charger_off(void);\n"
    )
    assert bind(folder, header="board.h") == 0
    told = " ".join(capsys.readouterr().err.split())
    assert "both have `CHARGER_AMPS_MAX`, `charger_show`" in told
    assert "--prefix charger_chart" in told


@pytest.mark.slow
@pytest.mark.parametrize("used", ["void beep(int k);", "enum { ALL = A40 };"])
def test_macros_that_expand_without_end_are_a_finding(
    used: str, reading: Callable[[str], Header], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(parsing, "MOST_SECONDS", 2)
    doubled = (f"#define A{n} (A{n - 1}+A{n - 1})\n" for n in range(1, 41))
    with pytest.raises(FsmkitError) as caught:
        reading("#define A0 1\n" + "".join(doubled) + used + "\n")
    (found,) = caught.value.diagnostics
    assert found.rule.name == "header-not-read"
    assert "to read" in found.message
