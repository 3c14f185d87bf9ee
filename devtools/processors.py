"""Generated C on other processors, as runtimes: ``c-arm``, ``c-size-powerpc`` ...

Cross compilers build the harness of the target `c`, and emulators run it, so that
``python -m devtools.differential --targets c-powerpc`` compares a big-endian machine with the
interpreter, its snapshots included. `make tools` installs compilers and emulators.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from fsmkit.chart.chart import Chart
from fsmkit.codegen.c.harness.harness import OPTIONS, Processor, run_many
from fsmkit.codegen.c.options import Options
from fsmkit.codegen.harness import Harness, Runtime

PROCESSORS: Mapping[str, Processor] = {
    "i386": Processor(("i686-linux-gnu-gcc", "-static", "-msse2", "-mfpmath=sse"), ("qemu-i386",)),
    "arm": Processor(("arm-linux-gnueabihf-gcc", "-static"), ("qemu-arm",)),
    "powerpc": Processor(("powerpc-linux-gnu-gcc", "-static"), ("qemu-ppc",)),
}
"""All have 32 bits. i386 aligns 64 bits to 4 bytes; powerpc is big-endian.

The x87 registers of i386 keep more digits than a `double`, so its C is compiled for SSE.
"""
FORMS: Mapping[str, Options] = {"c": OPTIONS, "c-size": replace(OPTIONS, is_small=True)}


@dataclass(frozen=True, slots=True)
class CrossC:
    """Generated C of one form on one processor; see `devtools.differential.Batched`."""

    options: Options
    processor: Processor

    def harness_run_all(self, jobs: Sequence[tuple[Chart, Sequence[str]]]) -> list[list[str]]:
        """Return the trace of each job."""
        return run_many(jobs, self.options, self.processor)

    def run(self, chart: Chart, script: Sequence[str]) -> list[str]:
        """Return the trace of a script."""
        (trace,) = self.harness_run_all([(chart, script)])
        return trace


def _runtime(form: str, processor: str) -> Harness:
    target = CrossC(FORMS[form], PROCESSORS[processor])
    return Runtime(f"{form}-{processor}", target.run, target)


CROSS: Mapping[str, Harness] = {
    f"{form}-{processor}": _runtime(form, processor) for form in FORMS for processor in PROCESSORS
}
