"""Packages: manifests by the tools that read them, sources and examples by their compilers."""

from __future__ import annotations

import ast
import json
import os
import re
import subprocess
import sys
import tarfile
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest
import yaml

from fsmkit.cli import execute
from tests.needs import need, where

ROOT = Path(__file__).parents[3]
FEEDER = ROOT / "machines" / "production_cell" / "feeder.yaml"
ZEPHYR = os.environ.get("FSMKIT_ZEPHYR", "")
KINDS = ("arduino", "esp-idf", "platformio", "zephyr")
HOSTILE = """
chart: "machine"
types: {Way: [left, right], Pair: {x: 0..9, y: bool}}
events: {in: ["go(n 0..300)"], out: ["gone(w Way)"]}
operations: ["turn(w Way, speed -5..5) -> Way", "both() -> Pair", "m()"]
data: {w: Way = left, p: Pair}
initial: a
states:
  a: {on: {go: {target: b, do: ["w = turn(right, 1)", "p = both()", m(), "send gone(w=w)"]}}}
  b: {after: {5ms: a}}
"""
STAND_INS = {
    "arduino": {
        "Arduino.h": "#include <stdint.h>\nextern unsigned long micros(void);\n"
        "void setup(void);\nvoid loop(void);\n"
    },
    "esp-idf": {
        "esp_timer.h": "#include <stdint.h>\nint64_t esp_timer_get_time(void);\n",
        "freertos/FreeRTOS.h": "",
        "freertos/task.h": "void app_main(void);\nvoid vTaskDelay(unsigned long);\n",
    },
    "zephyr": {
        "zephyr/kernel.h": "#include <stdint.h>\nint64_t k_uptime_ticks(void);\n"
        "uint64_t k_ticks_to_us_floor64(uint64_t);\nint k_msleep(int);\n"
    },
}
STAND_INS["platformio"] = STAND_INS["arduino"]


def packed(folder: Path, kind: str, chart: Path = FEEDER) -> Path:
    assert execute(["compile", str(chart), "--package", kind, "--out", str(folder), "-q"]) == 0
    return folder


@pytest.fixture
def hostile(tmp_path: Path) -> Path:
    path = tmp_path / "hostile.yaml"
    path.write_text(HOSTILE, encoding="utf-8")
    return path


def test_manifests_name_the_machine(tmp_path: Path, hostile: Path) -> None:
    made = {kind: packed(tmp_path / kind, kind, hostile) for kind in KINDS}
    rows = (made["arduino"] / "library.properties").read_text().splitlines()
    assert dict(row.split("=", 1) for row in rows)["includes"] == "machine.h"
    assert json.loads((made["platformio"] / "library.json").read_text())["name"] == "machine"
    component = yaml.safe_load((made["esp-idf"] / "idf_component.yml").read_text())
    assert re.fullmatch(r"\d+\.\d+\.\d+", component["version"])
    module = yaml.safe_load((made["zephyr"] / "zephyr" / "module.yml").read_text())
    assert (made["zephyr"] / module["build"]["kconfig"]).is_file()
    assert (made["zephyr"] / module["build"]["cmake"] / "CMakeLists.txt").is_file()
    for folder in made.values():
        assert (folder / "src" / "machine.c").is_file()


@pytest.mark.external
@pytest.mark.parametrize("kind", KINDS)
def test_sources_and_example_compile_against_stand_ins(
    kind: str, tmp_path: Path, hostile: Path, require_tool: Callable[[str], str]
) -> None:
    for place, text in STAND_INS[kind].items():
        path = tmp_path / "stand_ins" / place
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    us = tmp_path / "us.yaml"
    us.write_text(HOSTILE.replace('"machine"', "us"), encoding="utf-8")
    for number, chart in enumerate((FEEDER, hostile, us)):
        made = packed(tmp_path / str(number), kind, chart)
        (example,) = (
            p for p in made.rglob("*") if p.suffix in (".ino", ".cpp") or "main.c" in p.name
        )
        is_cpp = example.suffix != ".c"
        compiler = [require_tool("g++"), "-xc++"] if is_cpp else [require_tool("gcc"), "-std=c99"]
        includes = [f"-I{tmp_path / 'stand_ins'}", f"-I{made / 'src'}"]
        warnings = ["-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror", "-fsyntax-only"]
        done = subprocess.run(
            [*compiler, *warnings, *includes, str(example)],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.stderr == ""


@pytest.mark.external
def test_an_atmega_has_room_for_the_feeder(
    tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    made = packed(tmp_path, "arduino")
    compiler = require_tool("avr-gcc")
    flags = ["-mmcu=atmega2560", "-Os", "-std=c99", "-Wall", "-Wextra", "-Werror"]
    sources = sorted(map(str, (made / "src").glob("*.c")))
    subprocess.run(
        [compiler, *flags, "-r", "-nostdlib", *sources, "-o", "library.o"], cwd=tmp_path, check=True
    )
    sizes = subprocess.run(
        [require_tool("avr-size"), "library.o"],
        cwd=tmp_path, check=True, capture_output=True, text=True,
    ).stdout.splitlines()[1].split()  # fmt: skip
    assert int(sizes[0]) < 9000
    assert int(sizes[2]) == 0


@pytest.mark.external
def test_platformio_packs_it(tmp_path: Path) -> None:
    need(find_spec("platformio") is not None, "platformio")
    made = packed(tmp_path / "made", "platformio")
    archive = tmp_path / "x.tar.gz"
    done = subprocess.run(
        [sys.executable, "-m", "platformio", "pkg", "pack", str(made), "-o", str(archive)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert archive.stat().st_size > 1000


@pytest.mark.external
def test_a_riscv_has_room_for_the_feeder(
    tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    made = packed(tmp_path, "esp-idf")
    compiler = require_tool("riscv64-unknown-elf-gcc")
    flags = ["--specs=picolibc.specs", "-march=rv32imc", "-mabi=ilp32", "-Os", "-std=c99"]
    sources = sorted(map(str, (made / "src").glob("*.c")))
    warnings = ["-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror"]
    subprocess.run([compiler, *flags, *warnings, "-c", *sources], cwd=tmp_path, check=True)
    sizes = subprocess.run(
        [require_tool("riscv64-unknown-elf-size"), "feeder.o", "fsm.o"],
        cwd=tmp_path, check=True, capture_output=True, text=True,
    ).stdout.splitlines()[1:]  # fmt: skip
    rows = [[int(word) for word in row.split()[:3]] for row in sizes]
    assert sum(text for text, _, _ in rows) < 7000
    assert [(data, bss) for _, data, bss in rows] == [(0, 0), (0, 0)]


@pytest.mark.external
def test_espressif_packs_it(tmp_path: Path) -> None:
    need(find_spec("idf_component_manager") is not None, "idf-component-manager")
    made = packed(tmp_path / "made", "esp-idf")
    command = [sys.executable, "-m", "idf_component_manager", "component", "pack"]
    where_to = ["--name", "feeder", "--dest-dir", str(tmp_path / "dist")]
    environment = {**os.environ, "IDF_COMPONENT_CHECK_NEW_VERSION": "0", "HOME": str(tmp_path)}
    done = subprocess.run(
        [*command, *where_to], cwd=made, env=environment,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    version = yaml.safe_load((made / "idf_component.yml").read_text())["version"]
    with tarfile.open(tmp_path / "dist" / f"feeder_{version}.tgz") as archive:
        names = {Path(name).as_posix() for name in archive.getnames()}
    there = {p.relative_to(made).as_posix() for p in made.rglob("*") if p.is_file()}
    assert there <= names
    assert {"src/feeder.c", "src/fsm.c", "idf_component.yml"} <= there


@where(ZEPHYR, "no tree of Zephyr: FSMKIT_ZEPHYR names one, for the schema of its modules")
@pytest.mark.external
def test_zephyr_accepts_the_module(tmp_path: Path) -> None:
    need(find_spec("pykwalify") is not None, "pykwalify")
    script = (Path(ZEPHYR) / "scripts" / "zephyr_module.py").read_text(encoding="utf-8")
    (schema,) = (
        node.value.value
        for node in ast.parse(script).body
        if isinstance(node, ast.Assign)
        and isinstance(node.value, ast.Constant)
        and [t.id for t in node.targets if isinstance(t, ast.Name)] == ["METADATA_SCHEMA"]
    )
    core, errors = import_module("pykwalify.core"), import_module("pykwalify.errors")

    def read(data: object) -> None:
        rules = yaml.safe_load(str(schema))
        core.Core(source_data=data, schema_data=rules).validate()  # as Zephyr's script does

    module = yaml.safe_load((packed(tmp_path, "zephyr") / "zephyr" / "module.yml").read_text())
    read(module)
    module["build"]["kconfg"] = module["build"].pop("kconfig")
    with pytest.raises(errors.SchemaError, match="kconfg"):
        read(module)


@pytest.mark.parametrize("name", ["No", "On", "Null", "us", "Gpio", "Count"])
def test_names_that_mean_something_to_a_build(name: str, tmp_path: Path) -> None:
    chart = tmp_path / "chart.yaml"
    chart.write_text(HOSTILE.replace('"machine"', f'"{name}"'), encoding="utf-8")
    made = packed(tmp_path / "zephyr", "zephyr", chart)
    module = yaml.safe_load((made / "zephyr" / "module.yml").read_text())["name"]
    assert module in (name.lower(), f"{name.lower()}_machine")
    assert (made / "zephyr" / "Kconfig").read_text().startswith(f"config FSM_{module.upper()}\n")
    made = packed(tmp_path / "esp", "esp-idf", chart)
    (dependencies,) = made.rglob("main/idf_component.yml")
    assert [*yaml.safe_load(dependencies.read_text())["dependencies"]] == [module]


def test_a_prefix_that_the_build_has_itself(
    tmp_path: Path, hostile: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = ["compile", str(hostile), "--package", "arduino", "--out", str(tmp_path / "x")]
    assert execute([*made, "--prefix", "loop"]) == 2
    assert "use another: `--prefix loop_machine`" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--package", "arduino", "--target", "python"], "--package is for the target c"),
        (["--package", "ardiuno"], "arduino"),
        (["--target", "package"], "no kind of package is named"),
        (["--package", "zephyr", "--with", "trace"], "a trace replaces one of them"),
    ],
)
def test_what_cannot_be_packed(
    arguments: list[str], says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code = execute(["compile", str(FEEDER), "--out", str(tmp_path / "x"), *arguments])
    assert code in (1, 2)
    assert says in capsys.readouterr().err
    assert not (tmp_path / "x").exists()


def test_a_system_is_no_package(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    system = FEEDER.parent / "cell.yaml"
    assert execute(["compile", str(system), "--package", "zephyr", "--out", str(tmp_path)]) == 2
    assert "build a package for each chart" in capsys.readouterr().err
