"""MPI: the compiler of its programs, and the launcher for several processors or hosts."""

from __future__ import annotations

import hashlib
import json
import os
import shlex
import shutil
from collections.abc import Mapping
from pathlib import Path

from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.diagnostics.parsing import parse_json
from fsmkit.verify.resources.children import ChildResult
from fsmkit.verify.statespace.ranks import Ranks

INSTALL = "install Open MPI (Debian and Ubuntu: `apt install openmpi-bin libopenmpi-dev`)"
OVERSUBSCRIBED = {
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMPI_MCA_mpi_yield_when_idle": "1",
    "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
}
"""Open MPI, 4 and 5: there may be more ranks than processors, and who waits lets others work."""
AS_ROOT = ("OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM")
"""With both, Open MPI starts processes for root, too, as containers need."""
COMMIT = "commit"
"""In a folder of checkpoints, the file of the last one that all ranks have made."""


def mpi_compiler() -> str:
    """Return the path of ``mpicc``, or of the compiler in MPICC."""
    name = os.environ.get("MPICC") or "mpicc"
    path = shutil.which(name)
    if path is None:
        raise fail(
            "no-mpi",
            f"the MPI compiler `{name}` is missing",
            help=f"{INSTALL}, or name another in MPICC",
        )
    return path


def launcher(ranks: Ranks) -> list[str]:
    """Return the command that starts so many processes: ``mpirun``, or that of MPIRUN."""
    words = shlex.split(os.environ.get("MPIRUN") or "mpirun")
    if not words or shutil.which(words[0]) is None:
        raise fail(
            "no-mpi",
            f"the MPI launcher `{words[0] if words else ''}` is missing",
            help=f"{INSTALL}, or name another in MPIRUN, such as `srun --mpi=pmix`",
        )
    hosts = [] if ranks.hostfile is None else ["--hostfile", str(ranks.hostfile)]
    return [*words, "-n", str(ranks.count), *hosts]


def identity_of(*files: Mapping[str, str]) -> str:
    """Return the identity of a program, which must match to continue a search."""
    return hashlib.sha256(json.dumps([sorted(f.items()) for f in files]).encode()).hexdigest()[:32]


def checkpoint_options(ranks: Ranks, identity: str) -> list[str]:
    """Return the options of checkpoints. Raises `FsmkitError` if existing ones do not match."""
    if ranks.folder is None:
        return []
    try:
        ranks.folder.mkdir(parents=True, exist_ok=True)
        saved = (ranks.folder / COMMIT).read_text(encoding="utf-8")
    except FileNotFoundError:
        saved = ""
    except (OSError, UnicodeDecodeError) as error:
        raise _unusable(ranks.folder, f"`{ranks.folder}` cannot be used: {error}") from error
    if saved:
        _require_same(ranks, identity, saved)
    folder = str(ranks.folder.resolve())
    return ["--saved", folder, "--identity", identity, "--save-every", str(ranks.every)]


def _require_same(ranks: Ranks, identity: str, saved: str) -> None:
    try:
        record = parse_json(saved)
        count, of = int(record["ranks"]), str(record["identity"])
    except (ValueError, KeyError, TypeError) as error:
        raise _unusable(ranks.folder, "the checkpoints cannot be read") from error
    if of != identity:
        raise _unusable(ranks.folder, "the checkpoints belong to another system or other options")
    if count != ranks.count:
        raise _unusable(ranks.folder, f"the checkpoints have {count} ranks, not {ranks.count}")


def rank_failed(ranks: Ranks, done: ChildResult) -> FsmkitError:
    """Return the error for processes that ended without a result."""
    lines = [line.strip(" -") for line in done.err.splitlines() if not line.startswith("{")]
    telling = [line for line in lines if "noticed" in line] + [line for line in lines if line]
    said = telling[0] if telling else f"the exit code is {done.code}"
    if "as root" in said:
        way_out = f"run as another user, or set {' and '.join(f'{n}=1' for n in AS_ROOT)}"
    elif ranks.folder is None:
        way_out = "`--resume FOLDER` keeps checkpoints, from which a search goes on"
    else:
        way_out = f"run the command again: it goes on from the last checkpoint in `{ranks.folder}`"
    count = "1 rank" if ranks.count == 1 else f"{ranks.count} ranks"
    return fail("mpi-failed", f"no result of {count}: {said}", help=way_out)


def _unusable(folder: Path | None, why: str) -> FsmkitError:
    return fail(
        "no-such-checkpoint",
        why,
        help=f"empty `{folder}`, or name another folder; or continue with the original options",
    )
