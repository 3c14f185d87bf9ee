"""Run the checker of certificates, `checker.js`, by Node.js."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fsmkit.diagnostics import fail
from fsmkit.diagnostics.parsing import parse_json
from fsmkit.verify.state_certificates.encoding import json_line

CHECKER = Path(__file__).with_name("checker.js")
START = b'{"format":"fsmkit-states",'
"""The first bytes of each certificate; other files are rejected without Node.js."""


def check_certificate(
    certificate: Path,
    system: Path,
    *,
    parameters: Mapping[str, str],
    strict: bool = False,
    time: str | None = None,
) -> dict[str, Any]:
    """Return the result of the checker: ``accepted``, figures or the ``reason`` of a rejection.

    ``time``: the kind of time that the certificate must have; None: any.

    Raises `FsmkitError`: ``no-node`` without Node.js, ``unreadable-file`` for a certificate that
    cannot be read.
    """
    try:
        with certificate.open("rb") as file:
            start = file.read(len(START))
    except OSError as error:
        raise fail("unreadable-file", f"cannot read `{certificate}`: {error.strerror}") from error
    if start != START:
        return {"accepted": False, "reason": "it is not a certificate of states"}
    node = shutil.which("node")
    if node is None:
        raise fail("no-node", "there is no `node` on the path", help="install Node.js")
    given = json_line({"parameters": dict(parameters), "strict": strict, "options": "%"})
    given = given.replace('"%"', "%options%")
    steps = [sys.executable, "-m", "fsmkit.verify.state_certificates.steps", str(system), given]
    done = subprocess.run(
        [node, str(CHECKER), str(certificate), *steps],
        stdout=subprocess.PIPE,
        encoding="utf-8",
        check=False,
    )
    try:
        found: dict[str, Any] = parse_json(done.stdout)
    except ValueError:
        found = {"accepted": False, "reason": "the checker ended without a result"}
    if found["accepted"] and time not in (None, found["options"]["time"]):
        chosen = found["options"]["time"]
        return {"accepted": False, "reason": f"its time is {chosen}, not {time}"}
    return found
