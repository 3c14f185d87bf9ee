"""Compile a program of several C files, once for each content, and keep it in a cache."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shlex
import signal
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import NamedTuple

from fsmkit.diagnostics import Findings, FsmkitError, fail
from fsmkit.verify.engines.c.cache import Cache, UnusableError, cache_folder
from fsmkit.verify.resources.children import run
from fsmkit.verify.resources.deadline import Deadline, Stage

PROGRAM = "explore"
CORE = "core"
"""The folder of the sources of the core, beside those of a system."""
INCLUDES = re.compile(r'^[ \t]*#[ \t]*include[ \t]*"([^"]+)"', re.MULTILINE)
END = "[ $code -gt 128 ] && kill -$((code - 128)) $$\nexit $code"
"""Shell code that ends by the same signal as one of its children."""


class Unit(NamedTuple):
    """A file to compile: its path, that of its object and options for it alone."""

    source: str
    made: str
    options: tuple[str, ...]


class Builder:
    """Compiles with one command; its programs exist until it is closed."""

    def __init__(
        self,
        compiler: Sequence[str],
        deadline: Deadline,
        findings: Findings,
        parts: Path | None = None,
    ) -> None:
        """``compiler``: its path and options. If the cache is unusable, ``findings`` receives why.

        ``parts``: a folder in which each file is compiled separately, once for each content.
        Programs are then only linked from it, and not cached: for many programs with small
        differences.
        """
        self._parts = parts
        self._compiler = tuple(compiler)
        self._deadline = deadline
        self._findings = findings
        self._held = ExitStack()
        self._cache: Cache | None = None
        try:
            self._cache = Cache(cache_folder())
        except UnusableError as error:
            self._warn_uncached(str(error))

    def close(self) -> None:
        """Release cached programs, and remove the others."""
        self._held.close()

    def program(
        self, core: Mapping[str, str], files: Mapping[str, str], options: Sequence[str] = ()
    ) -> Path:
        """Return the program of these sources; programs share the objects of the core.

        The ``options`` are for the files only.

        Raises `FsmkitError` if the compilation fails, `TimeUp` if the compiler takes too long.
        """
        if self._parts is not None:
            with self._deadline.stage(Stage.COMPILING):
                return self._link(core, files, options, self._parts)
        name = self._name([core, files, dict.fromkeys(options, "")])
        found = self._find(name)
        if found is not None:
            return found / PROGRAM
        with self._deadline.stage(Stage.COMPILING):
            folder = self._folder()
            headers = {name: text for name, text in core.items() if name.endswith(".h")}
            sources = _write({**headers, **files}, folder)
            own = [Unit(source, f"{Path(source).stem}.o", tuple(options)) for source in sources]
            objects = self._objects(core, folder, own)
            made = [*(unit.made for unit in own), *map(str, objects), "-o", PROGRAM]
            self._compile([[made]], folder, [PROGRAM])
            return self._keep(name, {PROGRAM: folder / PROGRAM}) / PROGRAM

    def _link(
        self,
        core: Mapping[str, str],
        files: Mapping[str, str],
        options: Sequence[str],
        parts: Path,
    ) -> Path:
        """Return a program whose files are compiled separately, unless they exist already."""
        folder = self._folder()
        headers = {name: text for name, text in core.items() if name.endswith(".h")}
        whole = {**headers, **files}
        sources = _write(whole, folder)
        made = {
            source: parts
            / f"{self._name([_with_includes(source, whole), dict.fromkeys(options, '')])}.o"
            for source in sources
        }
        for is_last in (False, True):
            missing = [source for source in sources if not made[source].is_file()]
            own = [Unit(source, f"{Path(source).stem}.o", tuple(options)) for source in missing]
            core_objects = list(map(str, self._objects(core, folder, own)))
            try:
                for source in missing:
                    _put(folder / f"{Path(source).stem}.o", made[source])
                linked = [*map(str, made.values()), *core_objects, "-o", PROGRAM]
                self._compile([[linked]], folder, [PROGRAM])
            except OSError as error:
                raise _folder_error(error) from error
            except FsmkitError:
                if is_last or all(path.is_file() for path in made.values()):
                    raise  # otherwise another process emptied the folder of parts in between
            else:
                break
        return folder / PROGRAM

    def _objects(self, core: Mapping[str, str], folder: Path, others: Sequence[Unit]) -> list[Path]:
        """Return the objects of the core; other units in the folder are compiled beside them."""
        name = f"core-{self._name([core])}"
        kept = self._find(name)
        units = list(others)
        if kept is None:
            sources = _write({f"{CORE}/{path}": text for path, text in core.items()}, folder)
            units += [
                Unit(source, f"{CORE}/{Path(source).stem}.o", (f"-I{CORE}",)) for source in sources
            ]
        self._compile(_shares(units, folder), folder, [unit.made for unit in units])
        if kept is None:
            made = (folder / unit.made for unit in units[len(others) :])
            kept = self._keep(name, {path.name: path for path in made})
        return sorted(kept.glob("*.o"))

    def _name(self, texts: Iterable[Mapping[str, str]]) -> str:
        identity = json.dumps([self._compiler, [sorted(text.items()) for text in texts]])
        return hashlib.sha256(identity.encode()).hexdigest()[:32]

    # --- keeping -------------------------------------------------------------------------------

    def _find(self, name: str) -> Path | None:
        return None if self._cache is None else self._cache.find(name, self._held)

    def _keep(self, name: str, files: Mapping[str, Path]) -> Path:
        """Return the new location of files: in the cache, or where they were created."""
        if self._cache is not None:
            try:
                return self._cache.add(name, files, self._held)
            except OSError as error:
                self._cache = None
                self._warn_uncached((error.strerror or type(error).__name__).lower())
        return next(iter(files.values())).parent

    def _warn_uncached(self, why: str) -> None:
        place = ""
        with suppress(UnusableError):
            place = f" in `{cache_folder()}`"
        self._findings.add(
            "cache-not-used",
            f"the compiled explorer is not kept{place}: {why}",
            None,
            help="each check compiles it anew; `fsmkit cache` shows the folder, and "
            "XDG_CACHE_HOME names another",
        )

    # --- compiling -----------------------------------------------------------------------------

    def _folder(self) -> Path:
        """Return a new folder that exists until all is closed."""
        try:
            made = tempfile.TemporaryDirectory(prefix="fsmkit-", ignore_cleanup_errors=True)
        except OSError as error:
            raise _folder_error(error) from error
        return Path(self._held.enter_context(made))

    def _compile(
        self, shares: Sequence[Sequence[Sequence[str]]], folder: Path, made: Iterable[str]
    ) -> None:
        """Run the compiler with the arguments in each share, and the shares in parallel.

        Temporary files are in the folder. Raises `FsmkitError` if it fails, or does not write the
        files ``made``.
        """
        command = self._compiler[0]
        commands = [
            [[*self._compiler, "-I.", *arguments] for arguments in share] for share in shares
        ]
        if not commands:
            return
        try:
            done = run(
                _parallel_command(commands),
                seconds=self._deadline.left,
                folder=folder,
                environment={"TMPDIR": str(folder), "LC_ALL": "C"},
            )
        except OSError as error:
            reason = (error.strerror or type(error).__name__).lower()
            raise fail(
                "explorer-build",
                f"`{command}` cannot be run: {reason}",
                help="name another compiler in CC, or use `--engine python`",
            ) from error
        if done.code == 0 and all((folder / name).is_file() for name in made):
            return
        raise fail(
            "explorer-build",
            f"`{command}` cannot compile the explorer: {_compiler_message(done.code, done.err)}",
            help="free memory and disk space, name another compiler in CC, or use "
            "`--engine python`; if nothing of that helps, please report it",
        )


def _put(made: Path, target: Path) -> None:
    """Move a file to its shared location in one step, in a folder created anew.

    Other programs may empty temporary folders, and several processes may share one of parts.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    opened, name = tempfile.mkstemp(prefix=".new-", dir=target.parent)
    try:
        with os.fdopen(opened, "wb") as new:
            new.write(made.read_bytes())
        Path(name).replace(target)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def _with_includes(source: str, files: Mapping[str, str]) -> dict[str, str]:
    """Return a file with all of the others that it includes, at any depth."""
    found: dict[str, str] = {}
    left = [source]
    while left:
        name = left.pop()
        if name in files and name not in found:
            found[name] = files[name]
            left += INCLUDES.findall(files[name])
    return found


def _shares(units: Iterable[Unit], folder: Path) -> list[list[list[str]]]:
    """Return the arguments for all units, in a share of similar length for each processor."""
    shares: list[list[list[str]]] = [[] for _ in range(os.cpu_count() or 1)]
    lengths = [0] * len(shares)
    for length, unit in sorted(((folder / unit.source).stat().st_size, unit) for unit in units)[
        ::-1
    ]:
        least = lengths.index(min(lengths))
        lengths[least] += length
        shares[least].append([*unit.options, "-c", unit.source, "-o", unit.made])
    return [share for share in shares if share]


def _parallel_command(shares: Sequence[Sequence[Sequence[str]]]) -> Sequence[str]:
    """Return the command that runs the shares in parallel, each until its first failure.

    It ends when all have ended, with the code of a failure.
    """
    if len(shares) == 1 and len(shares[0]) == 1:
        return shares[0][0]
    lines = [" && ".join(map(shlex.join, share)) for share in shares]
    begin = [f"{{ {line}; }} & p{n}=$!" for n, line in enumerate(lines)]
    end = [f"wait $p{n} || code=$?" for n in range(len(lines))]
    return ("sh", "-c", "\n".join(["code=0", *begin, *end, END]))


def _compiler_message(code: int, words: str) -> str:
    """Return the most informative line of a compiler's output."""
    lines = [line.strip() for line in words.splitlines() if line.strip()]
    marked = [line for line in lines if "error" in line or "No space left" in line]
    if marked:
        return marked[0]
    if code < 0:
        with suppress(ValueError):
            return f"it was ended by {signal.Signals(-code).name}"
    return lines[-1] if lines else f"it ended with code {code}" if code else "it wrote no program"


def _write(files: Mapping[str, str], folder: Path) -> list[str]:
    """Write files, and return the names of those to compile."""
    try:
        for name, text in files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(text, encoding="utf-8")
    except OSError as error:
        raise _folder_error(error) from error
    return sorted(name for name in files if name.endswith(".c"))


def _folder_error(error: OSError) -> FsmkitError:
    """Return the error for a missing or full temporary folder."""
    reason = (error.strerror or type(error).__name__).lower()
    return fail(
        "explorer-build",
        f"the explorer cannot be compiled, because no folder is writable: {reason}",
        help="free space, or name another folder in TMPDIR; or use `--engine python`",
    )
