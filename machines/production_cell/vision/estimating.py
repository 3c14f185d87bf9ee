"""The cell's end of an estimator that is a program of its own, over ROS 2.

The node `cell` of deployment.yaml, in the interpreter: its machine sends each picture and
holds what is estimated. Where nobody looks at a clock, a run waits for each answer, so that it is
the same each time; an estimator that does not answer is waited for no longer until it does.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import fsmkit
from fsmkit.carriers.ros.domain import configuration
from fsmkit.carriers.ros.plugin import PLUGIN
from fsmkit.carriers.ros.translator import RosTranslator

from ..simulation.camera import BAD, GOOD, CameraState, Estimate
from ..simulation.nodes import ROOT, START, CellError

DEPLOYMENT = Path(__file__).with_name("deployment.yaml")
MODULE = f"{__package__}.estimator"
PATIENCE = 10.0
"""How long a run without a clock waits for an answer, in s."""
ASIDE = 0.2
"""When a picture of nothing is sent again, in s."""
POLL = 0.0002


class RosEstimator:
    """The estimator's process, and the node that communicates with it.

    ``waits``: a run without a clock, which waits for replies. ``domain``: of DDS. Raises
    `CellError` if it cannot be started.
    """

    def __init__(self, log: Path, drift: float, *, waits: bool, domain: int) -> None:
        if find_spec("cyclonedds") is None:
            raise CellError("cyclonedds is missing: pip install 'fsmkit[ros]'")
        self._log, self._waits, self._domain = log, waits, domain
        self._command = [sys.executable, "-m", MODULE, str(domain), "--drift", str(drift)]
        deployment = fsmkit.read(DEPLOYMENT)
        assert isinstance(deployment, fsmkit.Deployment)  # noqa: S101
        options = PLUGIN.foreign_options(deployment, "cell")["vision"]
        ros = replace(options["ros"], domain=domain)
        session = time.time_ns() // 1_000_000 % (1 << 31) + 1
        self.node = fsmkit.Node(
            deployment, "cell", session=session, foreign={"vision": {"ros": ros}}
        )
        (topics,) = self.node.link.translators
        assert isinstance(topics, RosTranslator)  # noqa: S101
        self._topics = topics
        self._process: subprocess.Popen[bytes] | None = None
        self._frames = self._now = self._unanswered = self._encoder = 0
        self._is_heard = False
        log.unlink(missing_ok=True)
        try:
            self._cycle()  # the machine starts
            self.begin()
        except BaseException:
            self.close()
            raise

    def begin(self) -> None:
        """Start the process, and wait until both sides are matched. Raises `CellError`.

        One side discovers the match of a reader and a writer first: the first reply can be lost. So
        a run that waits for replies starts with empty pictures.
        """
        self._is_heard = True
        with self._log.open("ab") as log:
            self._process = subprocess.Popen(
                self._command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, cwd=ROOT,
                start_new_session=True,
                env={**os.environ, "CYCLONEDDS_URI": configuration(is_insecure=False)},
            )  # fmt: skip
        end = time.monotonic() + START
        shown = -ASIDE
        while (
            self._topics.unheard
            or self._topics.unserved
            or (self._waits and not (shown > 0 and self._is_answered()))
        ):
            now = time.monotonic()
            if self._process.poll() is not None or now > end:
                said = self._log.read_text(errors="replace").strip().splitlines()[-3:]
                raise CellError("\n  ".join(["the estimator does not answer", *said]))
            if self._topics.unheard or self._topics.unserved:
                time.sleep(0.01)
            elif now - shown > ASIDE:
                shown = now
                self._send(self._encoder, 0, 0, 0)
            else:
                time.sleep(POLL)
                self._cycle()

    def __call__(self, state: CameraState, encoder: int) -> Estimate:
        """Send a new picture, and return what is known to be before the sorter."""
        if state.frames != self._frames:
            self._frames = state.frames
            self._show(state, encoder)
            if self._waits:
                self._wait()
        elif not self._waits:
            self._cycle()
        verdict = (BAD if self._value("reject") else GOOD) if self._value("sighted") else 0
        return Estimate(self._value("block"), verdict)

    def _show(self, state: CameraState, encoder: int) -> None:
        block, at, verdict = state.block, 0, 0
        if block and state.sightings and state.sightings[-1].encoder == encoder:
            at, verdict = state.sightings[-1].at, state.sightings[-1].verdict
        else:
            block = 0  # nothing was read in this picture
        self._send(encoder, block, at, verdict)

    def _send(self, encoder: int, block: int, at: int, verdict: int) -> None:
        self._encoder = encoder
        self.node.machines.post(
            "lookout", "take", encoder=encoder, block=block, at=at, verdict=verdict
        )
        self._cycle()

    def _wait(self) -> None:
        """Wait for the answer to the last picture, unless nobody has answered for a while."""
        is_dead = self._process is None or self._process.poll() is not None
        end = time.monotonic() + (PATIENCE if self._is_heard and not is_dead else 0.0)
        while not self._is_answered() and time.monotonic() < end:
            time.sleep(POLL)
            self._cycle()
        self._unanswered += not self._is_answered()
        self._is_heard = "hearing" in self.node.machines.active("lookout")

    def _is_answered(self) -> bool:
        return bool(self._value("answered") == self._value("number"))

    def _value(self, name: str) -> Any:
        return self.node.machines.value("lookout", name)

    def _cycle(self) -> None:
        self._now += 1
        self.node.cycle(self._now)

    def kill(self) -> None:
        """Kill the process."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None

    def report(self) -> dict[str, Any]:
        """Return what was counted."""
        counters = self.node.link.counters("vision")
        return {
            "pictures": self._frames,
            "unanswered": self._unanswered,
            "malformed": self.node.link.malformed,
            "restarts": counters.restarts,
        }

    def close(self) -> None:
        """End the process and leave the domain."""
        if self._process is not None:
            self._process.send_signal(signal.SIGTERM)
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(2.0)
        self.kill()
        self.node.close()
