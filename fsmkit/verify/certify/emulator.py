"""A machine in the emulator: it answers requests, and what it executes is counted."""

from __future__ import annotations

import ctypes
import importlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fsmkit.codegen.c.compiler import compile_c
from fsmkit.diagnostics import fail
from fsmkit.verify.certify.layout import Layout, layout_of
from fsmkit.verify.certify.processors import Processor
from fsmkit.verify.certify.program import FOLDER
from fsmkit.verify.certify.steps import MOST_VARYING

RELOCATED = (".got", ".data.rel.ro", ".toc", ".constants")
"""Sections that only the linker writes."""
PAGE = 0x1000
STACK = 0x10000
"""The bytes of the stack."""
MOST_RANGES, MOST_RECORDS, MOST_REDIRECTED = 16, 32768, 1024
INSTRUCTIONS = 20_000_000
"""The instructions of one step before it counts as endless."""
HOOK_CODE, HOOK_BLOCK, HOOK_MEMORY = 4, 8, 1024 | 2048
ANYWHERE = (1 << 64) - 1
WRONG = {1: "reads", 2: "writes"}


class _Range(ctypes.Structure):
    _fields_ = (("start", ctypes.c_uint64), ("end", ctypes.c_uint64))


class _Record(ctypes.Structure):
    _fields_ = tuple((name, ctypes.c_uint32) for name in ("instructions", "cycles", "stack"))


class _Probe(ctypes.Structure):
    """``probe`` of ``probe.c``."""

    _fields_ = (
        ("active", ctypes.c_void_p),
        ("active_address", ctypes.c_uint64),
        ("driver", _Range),
        ("stack", _Range),
        ("limit", ctypes.c_uint32),
        ("taken", ctypes.c_uint32),
        ("writable", ctypes.c_uint32),
        ("readable", ctypes.c_uint32),
        ("write", _Range * MOST_RANGES),
        ("read", _Range * MOST_RANGES),
        ("code", ctypes.c_void_p),
        ("coded", _Range),
        ("data", ctypes.c_void_p),
        ("stored", _Range),
        ("reads", ctypes.c_void_p),
        ("machine", _Range),
        ("inputs", ctypes.c_void_p),
        ("stop", ctypes.c_void_p),
        ("register_read", ctypes.c_void_p),
        ("register_write", ctypes.c_void_p),
        ("stack_register", ctypes.c_int),
        ("pc_register", ctypes.c_int),
        ("status_register", ctypes.c_int),
        ("argument_registers", ctypes.c_int * 3),
        ("count", ctypes.c_uint32),
        ("varying", ctypes.c_uint32),
        ("taken_steps", ctypes.c_uint32),
        ("now", _Record),
        ("wrong", ctypes.c_uint32),
        ("wrong_address", ctypes.c_uint64),
        ("wrong_pc", ctypes.c_uint64),
        ("pc", ctypes.c_uint64),
        ("top", ctypes.c_uint64),
        ("next", ctypes.c_uint64),
        ("was_active", ctypes.c_bool),
        ("blocks", ctypes.c_uint32),
        ("redirected_address", ctypes.c_uint64),
        ("redirected", ctypes.c_uint32),
        ("redirect", _Range * MOST_REDIRECTED),
        ("records", _Record * MOST_RECORDS),
    )


@dataclass(frozen=True, slots=True)
class Region:
    """A piece of memory of the emulator."""

    start: int
    data: Any

    @property
    def end(self) -> int:
        """The address after it."""
        return self.start + len(self.data)


@dataclass(frozen=True, slots=True)
class Symbol:
    """A function or a variable of a binary."""

    address: int
    size: int


@dataclass(frozen=True, slots=True)
class Image:
    """A binary as it is loaded: what the emulator needs of its file."""

    segments: tuple[tuple[int, bytes, int], ...]
    """Address, content and size in memory."""
    constants: tuple[tuple[int, int], ...]
    """Addresses and sizes of code and constants, which a machine may read."""
    symbols: Mapping[str, Symbol]
    layout: Layout
    redirected: tuple[tuple[int, int], ...] = ()
    """Addresses of functions, each with that of the function that is called in its place."""


def image_of(path: Path, struct: str) -> Image:
    """Read a binary with the layout of a struct."""
    from elftools.elf.elffile import ELFFile

    with path.open("rb") as file:
        elf = ELFFile(file)
        return Image(
            tuple(segments_of(elf)),
            constants_of(elf),
            symbols_of(elf),
            layout_of(elf.get_dwarf_info(), struct, is_big_endian=not elf.little_endian),
        )


def segments_of(elf: Any) -> Any:
    """Yield the loaded parts of a binary."""
    for segment in elf.iter_segments():
        if segment["p_type"] == "PT_LOAD" and segment["p_memsz"]:
            yield segment["p_vaddr"], segment.data(), segment["p_memsz"]


def constants_of(elf: Any) -> tuple[tuple[int, int], ...]:
    """Return the pieces of code and constants; neighbours are one piece."""
    found: list[tuple[int, int]] = []
    sections = (s for s in elf.iter_sections() if s["sh_flags"] & 2 and s["sh_size"])
    for section in sorted(sections, key=lambda each: each["sh_addr"]):
        if section["sh_flags"] & 1 and not section.name.startswith(RELOCATED):
            continue
        start, end = section["sh_addr"], section["sh_addr"] + section["sh_size"]
        if found and start - (found[-1][0] + found[-1][1]) < PAGE:
            start = found.pop()[0]
        found.append((start, end - start))
    return tuple(found[: MOST_RANGES - 1])


def symbols_of(elf: Any) -> dict[str, Symbol]:
    """Return the symbols of a binary; empty for a stripped one."""
    table = elf.get_section_by_name(".symtab")
    found = {}
    for symbol in () if table is None else table.iter_symbols():
        if symbol["st_shndx"] != "SHN_UNDEF" and symbol.name:
            found[symbol.name] = Symbol(symbol["st_value"], symbol["st_size"])
    return found


class StepError(Exception):
    """A step that ended in the emulator: an access, an instruction or an endless loop."""

    def __init__(self, request: int, why: str) -> None:
        """Name the request by number, and the reason."""
        super().__init__(why)
        self.request = request
        self.why = why


class Emulator:
    """A processor with a machine and its driver."""

    def __init__(
        self, image: Image, processor: Processor, folder: Path, inputs: Sequence[str] = ()
    ) -> None:
        """Load a binary.

        ``folder``: where the counting functions are built. ``inputs``: the members of the machine
        that hold its inputs, in C.
        """
        self.image = image
        self.processor = processor
        self._const = _constants(processor)
        self._order = "big" if processor.is_big_endian else "little"
        self._lib, self._hooks = _library(), _hooks(folder)
        self._uc = ctypes.c_void_p()
        mode = 0
        for name in processor.modes:
            mode |= self._number(name)
        self._call("uc_open", self._number(processor.architecture), mode, ctypes.byref(self._uc))
        if processor.model:
            ctl = 7 | 1 << 26 | 1 << 30  # UC_CTL_WRITE(UC_CTL_CPU_MODEL, 1)
            self._call("uc_ctl", self._uc, ctl, self._number(processor.model))
        self._regions: list[Region] = []
        self._map()
        self._probe = _Probe()
        self._observer = ctypes.c_size_t()
        self._inputs = self._input_numbers(inputs)
        self._watch()

    def __del__(self) -> None:
        """Free the emulator."""
        if getattr(self, "_uc", None):
            self._lib.uc_close(self._uc)

    def _number(self, name: str) -> int:
        return int(self._const[name])

    def _call(self, name: str, *arguments: Any) -> None:
        wrong = getattr(self._lib, name)(*arguments)
        if wrong:
            text = ctypes.c_char_p(self._lib.uc_strerror(wrong)).value or b""
            raise fail("certify-failed", f"the emulator failed in {name}: {text.decode()}")

    def _map(self) -> None:
        """Map memory for the segments of the binary, and a stack after them."""
        segments = self.image.segments
        pages = sorted(
            {p for a, _, size in segments for p in range(a // PAGE, -(-(a + size) // PAGE))}
        )
        last = pages[-1] + 2
        pages += range(last, last + STACK // PAGE)
        start = previous = pages[0]
        for page in [*pages[1:], -1]:
            if page != previous + 1:
                size = (previous + 1 - start) * PAGE
                data = (ctypes.c_uint8 * size)()
                self._regions.append(Region(start * PAGE, data))
                self._call(
                    "uc_mem_map_ptr", self._uc, ctypes.c_uint64(start * PAGE),
                    ctypes.c_size_t(size), 7, ctypes.byref(data),
                )  # fmt: skip
                start = page
            previous = page
        for address, content, _ in segments:
            self.write(address, content)
        self._stack = _Range(last * PAGE, last * PAGE + STACK)
        self._halt = self._address("certify_main") & ~1

    def _address(self, name: str) -> int:
        return self.image.symbols[name].address

    def _region(self, address: int) -> Region:
        return next(r for r in self._regions if r.start <= address < r.end)

    def write(self, address: int, data: bytes) -> None:
        """Store bytes in the memory."""
        region = self._region(address)
        ctypes.memmove(ctypes.addressof(region.data) + address - region.start, data, len(data))

    def read(self, address: int, size: int) -> bytes:
        """Return bytes of the memory."""
        region = self._region(address)
        return ctypes.string_at(ctypes.addressof(region.data) + address - region.start, size)

    def _pointer(self, address: int) -> int:
        region = self._region(address)
        return ctypes.addressof(region.data) + address - region.start

    def _input_numbers(self, inputs: Sequence[str]) -> Any:
        """Return for each byte of the machine 0, or the number of the input in it plus one."""
        found = (ctypes.c_uint8 * self.image.layout.size)()
        for part in self.image.layout.parts:
            for number, place in enumerate(inputs):
                if re.match(rf"\.{re.escape(place)}(?![^.\[])", part.path):
                    for offset in range(part.offset, part.offset + part.size):
                        found[offset] = 1 + min(number, MOST_VARYING)
        return found

    def _watch(self) -> None:
        """Install the hooks."""
        probe, symbols = self._probe, self.image.symbols
        assert self._hooks.probe_size() == ctypes.sizeof(_Probe)  # noqa: S101
        probe.active = self._pointer(self._address("certify_active"))
        probe.active_address = self._address("certify_active")
        probe.driver = _Range(
            self._address("certify_driver_start"), self._address("certify_driver_end")
        )
        probe.stack, probe.limit = self._stack, INSTRUCTIONS
        probe.taken = self.processor.taken
        writable = ["fsm_machine", "fsm_seen", "fsm_deadline"]
        for name in filter(symbols.__contains__, writable):
            at = symbols[name]
            probe.write[probe.writable] = _Range(at.address, at.address + at.size)
            probe.writable += 1
        event = symbols["fsm_event"]
        probe.read[0] = _Range(event.address, event.address + event.size)
        probe.readable = 1
        for address, size in self.image.constants:
            probe.read[probe.readable] = _Range(address, address + size)
            probe.readable += 1
        code = self._region(self._halt)
        probe.code = ctypes.addressof(code.data)
        probe.coded = _Range(code.start, code.end)
        data = self._region(self._address("certify_answers"))
        probe.data = ctypes.addressof(data.data)
        probe.stored = _Range(data.start, data.end)
        probe.reads = self._pointer(self._address("certify_reads"))
        machine = symbols["fsm_machine"]
        probe.machine = _Range(machine.address, machine.address + self.image.layout.size)
        probe.inputs = ctypes.addressof(self._inputs)
        probe.stop = ctypes.cast(self._lib.uc_emu_stop, ctypes.c_void_p).value
        probe.register_read = ctypes.cast(self._lib.uc_reg_read, ctypes.c_void_p).value
        probe.stack_register = self._number(self.processor.stack)
        probe.register_write = ctypes.cast(self._lib.uc_reg_write, ctypes.c_void_p).value
        status = self.processor.status
        probe.status_register = self._number(status) if status else -1
        probe.pc_register = self._number(self.processor.counter)
        probe.argument_registers[:] = [self._number(each) for each in self.processor.arguments]
        request, prepare, copy = (
            self._address(f"certify_{name}") & ~1 for name in ("request", "prepare", "copy")
        )
        for number, (start, to) in enumerate(self.image.redirected[:MOST_REDIRECTED]):
            probe.redirect[number] = _Range(start, to)
            probe.redirected += 1
        redirected = [
            (HOOK_CODE, "probe_redirect", start, start) for start, _ in self.image.redirected
        ]
        for kind, name, first, last in (
            *redirected,
            (HOOK_CODE, "probe_request", request, request),
            (HOOK_CODE, "probe_step", prepare, prepare),
            (HOOK_CODE, "probe_copy", copy, copy),
            (HOOK_CODE, "probe_code", probe.driver.end, ANYWHERE),
            (HOOK_CODE, "probe_code", 0, probe.driver.start - 1),
            (HOOK_BLOCK, "probe_block", probe.driver.start, probe.driver.end),
            (HOOK_MEMORY, "probe_memory", 1, 0),
        ):
            handle = ctypes.c_size_t()
            function = ctypes.cast(getattr(self._hooks, name), ctypes.c_void_p)
            self._call(
                "uc_hook_add", self._uc, ctypes.byref(handle), kind, function,
                ctypes.byref(probe), ctypes.c_uint64(first), ctypes.c_uint64(last),
            )  # fmt: skip

    def _set(self, register: str, value: int) -> None:
        holder = ctypes.c_uint64(value)
        self._call("uc_reg_write", self._uc, self._number(register), ctypes.byref(holder))

    def _set_word(self, name: str, value: int) -> None:
        self.write(self._address(name), value.to_bytes(4, self._order))  # type: ignore[arg-type]

    def _word(self, name: str) -> int:
        return int.from_bytes(self.read(self._address(name), 4), self._order)  # type: ignore[arg-type]

    def reload(self, address: int = 0, data: bytes = b"") -> None:
        """Load the binary again, with other bytes at an address: a seeded fault."""
        for start, content, size in self.image.segments:
            self.write(start, content + bytes(size - len(content)))
        if data:
            self.write(address, data)
        flush = self._number("UC_CTL_TB_FLUSH") | 1 << 30  # UC_CTL_WRITE
        self._call("uc_ctl", self._uc, flush)

    def limit_steps(self, instructions: int) -> None:
        """Set the number of instructions of a step before it counts as endless."""
        self._probe.limit = instructions

    def observe(self, function: Any) -> None:
        """Call a function for each instruction outside of the driver; None: no longer."""
        if function is None:
            self._call("uc_hook_del", self._uc, self._observer)
            return
        self._observer = ctypes.c_size_t()
        first, last = ctypes.c_uint64(self._probe.driver.end), ctypes.c_uint64(ANYWHERE)
        self._call(
            "uc_hook_add", self._uc, ctypes.byref(self._observer), HOOK_CODE, function, None,
            first, last,
        )  # fmt: skip

    def answer(self, state: bytes, requests: bytes) -> bytes:
        """Return the answers to requests from a state, a machine in this processor's layout.

        Raises `StepError` where the machine does what no step may do.
        """
        processor, probe = self.processor, self._probe
        probe.count = probe.wrong = probe.blocks = probe.taken_steps = 0
        self.write(self._address("fsm_state"), state)
        self.write(self._address("certify_requests"), requests)
        self._set_word("certify_request_size", len(requests))
        self._set_word("certify_answered", 0)
        self.write(self._address("certify_active"), b"\0")
        found: list[bytes] = []
        begin = self._address("certify_main")
        until = self._stack.end - 16
        while self._word("certify_answered") < len(requests):
            self._set(processor.stack, self._stack.end - 64)
            self._set(processor.link, until | processor.is_thumb)
            for register, symbol in processor.globals:
                if symbol in self.image.symbols:
                    self._set(register, self._address(symbol))
            for register, value in processor.values:
                self._set(register, value)
            wrong = self._lib.uc_emu_start(
                self._uc, ctypes.c_uint64(begin | processor.is_thumb), ctypes.c_uint64(until),
                ctypes.c_uint64(0), ctypes.c_size_t(0),
            )  # fmt: skip
            if wrong or probe.wrong:
                raise StepError(max(0, probe.count - 1), self._why(wrong))
            size = self._word("certify_answer_size")
            found.append(self.read(self._address("certify_answers"), size))
        return b"".join(found)

    @property
    def taken_steps(self) -> int:
        """The steps that the last answer took, each combination of inputs for itself."""
        return int(self._probe.taken_steps)

    def records(self) -> memoryview:
        """Return instructions, cycles and bytes of stack of each request of the last answer."""
        size = ctypes.sizeof(_Record) * self._probe.count
        return memoryview(self._probe.records).cast("B")[:size].cast("I")

    def _why(self, wrong: int) -> str:
        probe = self._probe
        where = f"at 0x{probe.wrong_pc:x}{self._function(probe.wrong_pc)}"
        if probe.wrong == 3:
            return "does not return"
        if probe.wrong:
            what = "outside the machine, the stack and the constants"
            return f"{WRONG[probe.wrong]} 0x{probe.wrong_address:x} {what}, {where}"
        text = ctypes.c_char_p(self._lib.uc_strerror(wrong)).value or b""
        where = f"after 0x{probe.pc:x}{self._function(probe.pc)}"
        return f"stops the emulator ({text.decode()}), {where}"

    def _function(self, address: int) -> str:
        for name, symbol in self.image.symbols.items():
            if symbol.size and symbol.address & ~1 <= address < (symbol.address & ~1) + symbol.size:
                return f" in `{name}`"
        return ""


def _constants(processor: Processor) -> dict[str, Any]:
    """Return the constants of the emulator for a processor."""
    names = dict(vars(importlib.import_module("unicorn.unicorn_const")))
    names |= vars(importlib.import_module(f"unicorn.{processor.family}_const"))
    return names


def require_emulator() -> None:
    """Raise `FsmkitError` if the extra with the emulator is not installed."""
    try:
        importlib.import_module("unicorn")
        importlib.import_module("elftools")
    except ImportError as error:
        raise fail(
            "missing-package",
            f"the emulator is not installed: {error.name}",
            help="run `pip install 'fsmkit[certify]'`",
        ) from error


def _library() -> ctypes.CDLL:
    package = importlib.import_module("unicorn").__file__
    assert package is not None  # noqa: S101
    for path in sorted((Path(package).parent / "lib").glob("libunicorn*")):
        if path.suffix != ".a":
            library = ctypes.CDLL(str(path))
            library.uc_strerror.restype = ctypes.c_void_p
            return library
    raise fail("missing-package", "the library of the emulator is missing from `unicorn`")


def _hooks(folder: Path) -> ctypes.CDLL:
    """Build the counting functions with the compiler of this computer."""
    (folder / "probe.c").write_text(
        (FOLDER / "probe.c").read_text(encoding="utf-8"), encoding="utf-8"
    )
    compile_c(["-O2", "-fPIC", "-shared", "probe.c", "-o", "probe.so"], folder)
    library = ctypes.CDLL(str(folder / "probe.so"))
    library.probe_size.restype = ctypes.c_size_t
    return library
