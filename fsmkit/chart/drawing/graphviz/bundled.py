"""Graphviz as WebAssembly, run by wasmtime within this process.

The module is the one of the npm package ``@viz-js/viz``; ``python -m devtools.graphviz_module``
copies it into this folder. A program of Emscripten imports functions of its host. Only memory,
messages and the environment matter here: the module receives no file, no clock and no chance, so
equal texts give equal drawings.
"""

from __future__ import annotations

import atexit
import struct
from collections.abc import Callable, Sequence
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any

from fsmkit.diagnostics.parsing import parse_json

if TYPE_CHECKING:
    import wasmtime

MODULE = Path(__file__).with_name("graphviz.wasm")
NAMES = Path(__file__).with_name("names.json")
"""The names of the module's imports and exports, which are one letter in it."""
PAGE = 65_536
"""Bytes of a page of memory."""
MOST_BYTES = 2_000_000_000
FONTS = "Helvetica,Arial,sans-serif"
"""The fonts of drawings, of which the module knows one by its widths."""
KNOWN_FONT = "Arial"
ENGINES = {"dot": "dot", "neato -n2": "nop2"}


class GraphvizError(Exception):
    """Graphviz rejected a graph, or ended before it was laid out."""


def missing_part() -> str | None:
    """Return what is missing to run the module, as a clause; None if nothing is."""
    if not MODULE.exists() or not NAMES.exists():
        return "this installation was built without its own (`make graphviz` adds it)"
    if find_spec("wasmtime") is None:
        return "the package `wasmtime`, which runs the bundled one, is not installed"
    try:
        _compiled()
    except Exception as error:  # noqa: BLE001  # a machine without a native compiler, no memory ...
        return f"the bundled one cannot be run: {error}"
    return None


def run(text: str, formats: Sequence[str], layout: str, seconds: float | None = None) -> bytes:
    """Return the output of Graphviz in several formats; raises `GraphvizError`.

    The layout runs in a thread of its own, so that an interrupt from the keyboard ends the wait,
    and so does the end of the given time.
    """
    result: list[bytes | Exception] = []

    def work() -> None:
        try:
            result.append(_Instance().run(text, formats, ENGINES[layout]))
        except Exception as error:  # noqa: BLE001  # raised again below
            result.append(error)

    thread = Thread(target=work, daemon=True)
    thread.start()
    thread.join(seconds)
    if not result:
        raise GraphvizError(f"it took more than {seconds:g} s")
    match result[0]:
        case GraphvizError() as error:
            raise error
        case Exception() as error:
            raise GraphvizError(str(error).splitlines()[0]) from error
        case output:
            return output


@cache
def _compiled() -> tuple[wasmtime.Engine, wasmtime.Module, dict[str, dict[str, str]]]:
    """Return the compiled module and its names; wasmtime keeps the compiled code in its cache."""
    import wasmtime

    atexit.register(_compiled.cache_clear)  # its destructors need modules that Python unloads
    config = wasmtime.Config()
    config.cache = True
    engine = wasmtime.Engine(config)
    module = wasmtime.Module(engine, MODULE.read_bytes())
    return engine, module, parse_json(NAMES.read_bytes())


class _Instance:
    """One run of the module, with its own memory."""

    def __init__(self) -> None:
        import wasmtime

        engine, module, names = _compiled()
        self._store = wasmtime.Store(engine)
        self._names = names["exports"]
        self._messages: list[str] = []
        hosted = self._hosted()
        imports = [
            wasmtime.Func(self._store, kind, hosted.get(name) or _unavailable(name))
            for each in module.imports
            if isinstance(kind := each.type, wasmtime.FuncType)
            for name in [names["imports"].get(each.name or "", each.name or "")]
        ]
        self._exports: Any = wasmtime.Instance(self._store, module, imports).exports(self._store)
        self._memory: Any = self._exports[self._names["memory"]]
        self._call("constructors")

    def run(self, text: str, formats: Sequence[str], engine: str) -> bytes:
        """Lay a graph out and return it in these formats."""
        graph = self._call("viz_read_one_graph", self._put(_with_known_font(text)))
        if not graph:
            raise self._error()
        context = self._call("viz_create_context")
        self._call("viz_reset_errors")
        if self._call("viz_layout", context, graph, self._put(engine)):
            raise self._error()
        outputs: list[bytes] = []
        for kind in formats:
            output = self._call("viz_render", context, graph, self._put(kind))
            if not output:
                raise self._error()
            outputs.append(self._string(output))
        return _with_fonts(b"".join(outputs))

    # --- memory --------------------------------------------------------------------------------

    def _call(self, name: str, *arguments: int) -> Any:
        return self._exports[self._names[name]](self._store, *arguments)

    def _put(self, text: str) -> int:
        """Copy a string into the memory; return its address."""
        content = text.encode() + b"\0"
        address: int = self._call("malloc", len(content))
        self._memory.write(self._store, content, address)
        return address

    def _read(self, address: int, size: int) -> bytes:
        return bytes(self._memory.read(self._store, address, address + size))

    def _string(self, address: int) -> bytes:
        """Return a string that ends with a zero byte."""
        parts: list[bytes] = []
        while True:
            size = min(PAGE, self._memory.data_len(self._store) - address)
            part, end, _ = self._read(address, size).partition(b"\0")
            parts.append(part)
            if end or not size:
                return b"".join(parts)
            address += size

    def _error(self) -> GraphvizError:
        lines = "".join(self._messages).strip().splitlines()
        errors = [line for line in lines if not line.startswith("Warning")]
        return GraphvizError((errors or lines or ["no reason was given"])[0])

    # --- what the module imports ---------------------------------------------------------------

    def _hosted(self) -> dict[str, Callable[..., Any]]:
        return {
            "viz_errorf": self._take_message,
            "_emscripten_resize_heap": self._grow,
            "_fd_write": self._write_out,
            "_environ_sizes_get": self._count_environment,
            "_environ_get": lambda *_: 0,
            "_random_get": self._fill,
            "_emscripten_date_now": lambda: 0.0,
            "_exit": self._exit,
        }

    def _take_message(self, address: int) -> int:
        self._messages.append(self._string(address & 0xFFFF_FFFF).decode(errors="replace"))
        return 0

    def _grow(self, size_needed: int) -> int:
        """Grow the memory to so many bytes, by a fifth at least; return 0 if it cannot."""
        size = self._memory.data_len(self._store)
        missing = (size_needed & 0xFFFF_FFFF) - size
        if size + missing > MOST_BYTES:
            return 0
        self._memory.grow(self._store, max(-(-missing // PAGE), size // PAGE // 5))
        return 1

    def _write_out(self, _: int, vectors: int, count: int, written: int) -> int:
        """Keep what is printed as messages."""
        total = 0
        for number in range(count):
            address, size = struct.unpack("<II", self._read(vectors + 8 * number, 8))
            self._messages.append(self._read(address, size).decode(errors="replace"))
            total += size
        self._memory.write(self._store, struct.pack("<I", total), written)
        return 0

    def _count_environment(self, count: int, size: int) -> int:
        for address in (count, size):
            self._memory.write(self._store, bytes(4), address)
        return 0

    def _fill(self, address: int, size: int) -> int:
        self._memory.write(self._store, bytes(size), address)
        return 0

    def _exit(self, code: int) -> None:
        raise GraphvizError(f"it ended with {code}: {self._error()}")


def _unavailable(name: str) -> Callable[..., Any]:
    """Return a function of the host that no layout needs: files, clocks, exceptions."""

    def call(*_: Any) -> None:
        raise GraphvizError(f"it called `{name}`, which is not available")

    return call


def _with_known_font(text: str) -> str:
    return text.replace(f'fontname="{FONTS}"', f'fontname="{KNOWN_FONT}"')


def _with_fonts(output: bytes) -> bytes:
    """Return an output whose texts name all fonts again; a layout keeps the known one."""
    return output.replace(f'font-family="{KNOWN_FONT}"'.encode(), f'font-family="{FONTS}"'.encode())
