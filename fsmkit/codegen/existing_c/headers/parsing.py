"""Reads a header with libclang in two passes: declarations, then the values of macros.

After an error clang continues with a guess (``int`` for an unknown type). Therefore any error ends
the reading: ``header-not-read``.
"""

from __future__ import annotations

import multiprocessing
import os
import resource
from collections.abc import Iterator, Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from fsmkit.chart.loading import read_bytes
from fsmkit.codegen.existing_c.headers.folders import Compiler
from fsmkit.codegen.existing_c.headers.model import (
    Constant,
    CType,
    Enumeration,
    Function,
    Header,
    Member,
    Sort,
    Struct,
)
from fsmkit.codegen.existing_c.tokens import read_expression
from fsmkit.diagnostics import Findings, FsmkitError, Source, Span, Text, fail
from fsmkit.diagnostics.paths import is_file

LARGEST_MACRO = 2_000
"""The greatest length in characters of a macro whose value is computed."""
PREFIX = "fsm_value_of_"
"""The prefix of the constants that receive the values of macros."""
MOST_SECONDS = 10
"""The limit of processor seconds for a header; the largest vendor header takes two."""
MOST_MEMORY = 4 << 30
"""The limit of address space in bytes, beside what this process has already."""
BITS = {8, 16, 32, 64}


def read_header(path: Path, compiler: Compiler, options: Sequence[str]) -> Header:
    """Return the declarations of a header.

    Args:
        path: The header.
        compiler: The folders and the target of the build's compiler.
        options: The options of the build: ``-I``, ``-D`` and the like.

    Raises:
        FsmkitError: ``missing-package`` without libclang, ``header-not-read`` after a syntax error
            or for a missing file, ``empty-file``.

    """
    if not is_file(path):
        raise fail(
            "header-not-read", f"there is no header `{path}`", help="name a file of C declarations"
        )
    if not read_bytes(path).strip():
        raise fail("empty-file", f"`{path}` is empty", help="name a file of C declarations")
    return _parsed(path, compiler, options)


def _parsed(path: Path, compiler: Compiler, options: Sequence[str]) -> Header:
    """Parse a header in a child process with limits for memory and time.

    Forty macros, each of which uses the previous one twice, expand to 10^12 tokens, and libclang
    has no limit of its own.
    """
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)
    child = context.Process(target=_parse_within_bounds, args=(path, compiler, options, sender))
    child.start()
    sender.close()
    try:
        found = receiver.recv()
    except EOFError:
        found = fail(
            "header-not-read",
            f"`{path.name}` takes more than {MOST_SECONDS} s or {MOST_MEMORY >> 20:,} MiB to read",
            help="bind a smaller header, or look for macros that expand to very long texts",
        )
    except BaseException:
        child.kill()
        raise
    finally:
        receiver.close()
        child.join()
        child.close()
    if isinstance(found, Header):
        return found
    raise found


def _parse_within_bounds(
    path: Path, compiler: Compiler, options: Sequence[str], sender: Connection
) -> None:
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 2)  # what libclang writes when memory ends
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (MOST_SECONDS, MOST_SECONDS))
    most = _address_space() + MOST_MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    try:
        sender.send(_Parser(path, compiler, options).header())
    except FsmkitError as error:
        sender.send(error)


def _address_space() -> int:
    """Return the bytes of address space of this process; 0 where the system does not count them.

    Libraries reserve much of it without using memory: WebAssembly for drawings, hundreds of GiB.
    """
    try:
        pages = Path("/proc/self/statm").read_text(encoding="ascii").split()[0]
    except OSError:
        return 0
    return int(pages) * resource.getpagesize()


def _cindex() -> Any:
    try:
        from clang import cindex

        cindex.conf.lib  # noqa: B018  (loads the library)
    except Exception as error:  # (ImportError, or LibclangError of a package without its library)
        raise fail(
            "missing-package",
            "reading headers needs the package libclang, which is missing or does not load",
            help="install it: `pip install fsmkit[headers]`; or write the binding by hand",
        ) from error
    return cindex


class _Parser:
    """Parses one header."""

    def __init__(self, path: Path, compiler: Compiler, options: Sequence[str]) -> None:
        self.clang = _cindex()
        self.path = path.resolve()
        self.name = path.name
        target = [f"--target={compiler.target}"] if compiler.target else []
        folders = [word for folder in compiler.folders for word in ("-isystem", folder)]
        self.arguments = [
            "-x",
            "c",
            "-std=gnu11",
            *target,
            *compiler.options,
            *options,
            "-nostdinc",
            *folders,
        ]
        self.arguments += ["-ferror-limit=0", "-w"]

    def header(self) -> Header:
        cursors = self.clang.CursorKind
        constants: dict[str, Constant] = {}
        enumerations, structs, functions = [], [], []
        macros: dict[str, tuple[str, bool]] = {}
        unit = self._parse(None)
        self._stop_on_errors(unit)
        for cursor in unit.cursor.get_children():
            kind = cursor.kind
            if kind == cursors.MACRO_DEFINITION:
                if cursor.location.file is not None:
                    macros[cursor.spelling] = self._macro(cursor), self._is_own(cursor)
            elif kind == cursors.FUNCTION_DECL or kind == cursors.VAR_DECL:
                functions.append(self._function(cursor, is_variable=kind == cursors.VAR_DECL))
            elif kind == cursors.ENUM_DECL and cursor.is_definition():
                enumerations.append(self._enumeration(cursor, cursor.type.spelling))
            elif kind == cursors.STRUCT_DECL and cursor.is_definition():
                structs.append(self._struct(cursor, cursor.type.spelling))
            elif kind == cursors.TYPEDEF_DECL:
                found = cursor.underlying_typedef_type.get_canonical().get_declaration()
                if found.kind == cursors.ENUM_DECL and found.is_definition():
                    enumerations.append(self._enumeration(found, cursor.spelling))
                elif found.kind == cursors.STRUCT_DECL and found.is_definition():
                    structs.append(self._struct(found, cursor.spelling))
        named = [each for each in enumerations if _is_called(each.name)]
        for enumeration in enumerations:
            constants |= {each.name: each for each in enumeration.constants}
        constants |= {each.name: each for each in self._values(macros)}
        return Header(
            self.name,
            tuple(constants.values()),
            tuple({each.name: each for each in named}.values()),
            tuple({each.name: each for each in structs if _is_called(each.name)}.values()),
            tuple({each.name: each for each in functions}.values()),
            len(macros),
        )

    def _parse(self, text: str | None) -> Any:
        """Return the translation unit of the header, or of a text that includes it."""
        options = self.clang.TranslationUnit
        flags = options.PARSE_SKIP_FUNCTION_BODIES
        name, unsaved = str(self.path), None
        if text is None:
            flags |= options.PARSE_DETAILED_PROCESSING_RECORD
        else:
            name = str(self.path.with_name("fsm_macros.c"))
            unsaved = [(name, text)]
        try:
            return self.clang.Index.create().parse(name, self.arguments, unsaved, flags)
        except self.clang.TranslationUnitLoadError as error:
            raise fail(
                "header-not-read",
                f"`{self.path.name}` cannot be read with these options",
                help="give the compiler options of your build after `--`",
            ) from error

    def _stop_on_errors(self, unit: Any) -> None:
        errors = [each for each in unit.diagnostics if each.severity >= self.clang.Diagnostic.Error]
        if not errors:
            return
        first = errors[0]
        more = f", and {len(errors) - 1} more" if len(errors) > 1 else ""
        file = first.location.file
        where = f"{file.name}:{first.location.line}: " if file is not None else ""
        raise fail(
            "header-not-read",
            f"{where}{first.spelling}{more}",
            _place(first),
            help="give the compiler options of your build after `--`, as "
            "`-- -Iinc -DSTM32F407xx`, and set CC to the compiler of the target",
        )

    # --- declarations ---------------------------------------------------------------------------

    def _is_own(self, cursor: Any) -> bool:
        file = cursor.location.file
        return file is not None and Path(file.name).name == self.name

    def _function(self, cursor: Any, *, is_variable: bool) -> Function:
        type_ = cursor.type if is_variable else cursor.result_type
        arguments = () if is_variable else tuple(self._type(a.type) for a in cursor.get_arguments())
        is_own = self._is_own(cursor)
        is_prototype = cursor.type.kind == self.clang.TypeKind.FUNCTIONPROTO
        if is_prototype and cursor.type.is_function_variadic():
            arguments = (*arguments, CType("...", Sort.OTHER))
        is_constant = is_variable and type_.is_const_qualified()
        return Function(
            cursor.spelling, self._type(type_), arguments, is_variable, is_own, is_constant
        )

    def _enumeration(self, cursor: Any, name: str) -> Enumeration:
        is_own = self._is_own(cursor)
        constants = tuple(
            Constant(each.spelling, each.enum_value, name, is_own)
            for each in cursor.get_children()
            if each.kind == self.clang.CursorKind.ENUM_CONSTANT_DECL
        )
        return Enumeration(name, constants, is_own)

    def _struct(self, cursor: Any, name: str) -> Struct:
        members, rejection = [], ""
        for each in cursor.type.get_fields():
            if not each.spelling.isidentifier():  # padding of bit-fields, or what has no name
                if not each.is_bitfield():
                    rejection = rejection or "it holds a struct or a union without a name"
                continue
            type_, count = self._element(each.type)
            if type_.sort is Sort.OTHER or count < 0:
                rejection = rejection or f"`{each.spelling}` is {_description(each.type.spelling)}"
            elif each.is_bitfield():
                type_ = _narrowed(type_, each.get_bitfield_width())
            members.append(Member(each.spelling, type_, max(count, 0)))
        if not members:
            rejection = "it has no member"
        return Struct(name, tuple(members), rejection, self._is_own(cursor))

    def _element(self, type_: Any) -> tuple[CType, int]:
        """Return the type of a member, or of its elements and their number; -1: unknown."""
        kinds = self.clang.TypeKind
        canonical = type_.get_canonical()
        if canonical.kind == kinds.CONSTANTARRAY:
            return self._type(canonical.element_type), canonical.element_count or -1
        if canonical.kind in (kinds.INCOMPLETEARRAY, kinds.VARIABLEARRAY):
            return self._type(canonical.element_type), -1
        return self._type(type_), 0

    def _type(self, type_: Any) -> CType:
        kinds = self.clang.TypeKind
        spelling, canonical = type_.spelling, type_.get_canonical()
        kind = canonical.kind
        if kind == kinds.VOID:
            return CType(spelling, Sort.NOTHING)
        if kind == kinds.BOOL:
            return CType(spelling, Sort.BOOL, 0, 1)
        if kind in (kinds.FLOAT, kinds.DOUBLE):
            return CType(spelling, Sort.FLOAT)
        signed = (kinds.CHAR_S, kinds.SCHAR, kinds.SHORT, kinds.INT, kinds.LONG, kinds.LONGLONG)
        unsigned = (
            kinds.CHAR_U, kinds.UCHAR, kinds.USHORT, kinds.UINT, kinds.ULONG, kinds.ULONGLONG,
        )  # fmt: skip
        sort = Sort.ENUM if kind == kinds.ENUM else Sort.INTEGER
        bits = canonical.get_size() * 8
        if kind == kinds.ENUM:
            kind = canonical.get_declaration().enum_type.get_canonical().kind
        if bits in BITS and kind in signed:
            return CType(spelling, sort, -(1 << (bits - 1)), (1 << (bits - 1)) - 1)
        if bits in BITS and kind in unsigned:
            return CType(spelling, sort, 0, (1 << bits) - 1)
        return CType(spelling, Sort.OTHER)

    # --- macros ---------------------------------------------------------------------------------

    def _macro(self, cursor: Any) -> str:
        """Return the replacement of a macro, or "" for a macro with parameters."""
        if self.clang.conf.lib.clang_Cursor_isMacroFunctionLike(cursor):
            return ""
        start, end = cursor.extent.start.offset, cursor.extent.end.offset
        if end - start > LARGEST_MACRO:
            return ""
        return " ".join(token.spelling for token in list(cursor.get_tokens())[1:])

    def _values(self, macros: dict[str, tuple[str, bool]]) -> Iterator[Constant]:
        """Yield the macros with integer values, each with the compiler's value."""
        candidates = [name for name, (text, _) in macros.items() if text and _is_expression(text)]
        if not candidates:
            return
        lines = [f'#include "{self.name}"']
        for number, name in enumerate(candidates):
            lines.append(f"enum {{ {PREFIX}{number} = ({name}) }};")
            lines.append(f"extern __typeof__({name}) fsm_type_of_{number};")
        unit = self._parse("\n".join(lines) + "\n")
        wrong = {
            each.location.line
            for each in unit.diagnostics
            if each.severity >= self.clang.Diagnostic.Error
            and each.location.file is not None
            and each.location.file.name == unit.spelling
        }
        types: dict[int, str] = {}
        values: dict[int, int] = {}
        for cursor in unit.cursor.get_children():
            if cursor.location.file is None or cursor.location.file.name != unit.spelling:
                continue
            line = cursor.location.line
            number = line // 2 - 1
            if line in wrong:
                continue
            if cursor.kind == self.clang.CursorKind.ENUM_DECL:
                values[number] = next(each.enum_value for each in cursor.get_children())
            elif cursor.kind == self.clang.CursorKind.VAR_DECL:
                types[number] = cursor.type.get_canonical().spelling
        for number, name in enumerate(candidates):
            if number in values and number in types:
                yield Constant(name, values[number], types[number], macros[name][1])


def _is_expression(text: str) -> bool:
    """Whether a text may be a single expression, so an error in it stays in its line."""
    source = Source("<macro>", text)
    return read_expression(Text(text, Span(source, 0, len(text))), Findings()) is not None


def _is_called(name: str) -> bool:
    """Whether a type has a name; clang describes others by their location."""
    words = name.split()
    is_tag = len(words) == 2 and words[0] in ("struct", "enum")
    return (is_tag or len(words) == 1) and words[-1].isidentifier()


def _description(spelling: str) -> str:
    """Return a description of a member; clang names an anonymous type by its location."""
    if "(" in spelling and " at " in spelling:
        return "a union or a struct without a name"
    return f"of the type {spelling}"


def _narrowed(type_: CType, bits: int) -> CType:
    """Return the type of a bit-field with the given number of bits."""
    if type_.sort is not Sort.INTEGER or bits <= 0:
        return type_
    if type_.lo < 0:
        return CType(type_.spelling, type_.sort, -(1 << (bits - 1)), (1 << (bits - 1)) - 1)
    return CType(type_.spelling, type_.sort, 0, (1 << bits) - 1)


def _place(diagnostic: Any) -> Span | None:
    """Return the location of an error in its file, if that is readable text."""
    location = diagnostic.location
    if location.file is None:
        return None
    try:
        text = Path(location.file.name).read_text(encoding="utf-8")
    except (OSError, ValueError):
        return None
    source = Source(location.file.name, text)
    start = source.offset(max(location.line, 1), max(location.column, 1))
    return Span(source, start, min(start + 1, len(text)))
