"""Objects of Python modules by their names, ``module:attribute`` or ``file.py:attribute``.

Importing a module runs it. So only what a user names himself is imported, never what a chart names.
"""

from __future__ import annotations

import re
import sys
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.diagnostics.paths import path_exists

REFERENCE = re.compile(r"(?P<module>.+\.py|[^\W\d]\w*(?:\.[^\W\d]\w*)*):(?P<name>[^\W\d][\w.]*)")


def is_reference(text: str) -> bool:
    """Return whether a text names an object of a module, not a file."""
    return REFERENCE.fullmatch(text) is not None and not path_exists(Path(text))


def import_object(text: str) -> object:
    """Return the object that a reference names; `FsmkitError` if it does not exist."""
    match = REFERENCE.fullmatch(text)
    if match is None:
        raise _failed(text, "it is not a `module:attribute`")
    found: object = _module(text, match["module"])
    for name in match["name"].split("."):
        try:
            found = getattr(found, name)
        except AttributeError:
            raise _failed(text, f"`{match['module']}` has no `{name}`") from None
    return found


def _module(text: str, name: str) -> ModuleType:
    before = list(sys.path)
    sys.path.insert(0, str(Path(name).parent.resolve() if name.endswith(".py") else Path.cwd()))
    try:
        return _from_file(Path(name)) if name.endswith(".py") else import_module(name)
    except (Exception, SystemExit) as error:
        raise _failed(text, _describe_error(error)) from error
    finally:
        sys.path[:] = before


def _from_file(path: Path) -> ModuleType:
    spec = spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"`{path}` is not a module")
    module = module_from_spec(spec)
    sys.modules.setdefault(path.stem, module)
    spec.loader.exec_module(module)
    return module


def _describe_error(error: BaseException) -> str:
    """Return the message of an error, with the line of the user's code."""
    trace, place = error.__traceback__, ""
    while trace is not None:
        file = trace.tb_frame.f_code.co_filename
        if file != __file__ and not file.startswith("<frozen"):
            place = f", in {file}:{trace.tb_lineno}"
        trace = trace.tb_next
    return f"{type(error).__name__}: {error}{place}"


def _failed(text: str, reason: str) -> FsmkitError:
    return fail(
        "no-machine",
        f"cannot import `{text}`: {reason}",
        help="write `module:attribute` or `file.py:attribute`",
    )
