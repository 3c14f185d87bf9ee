"""Generated C in two forms, with sanitizers and on other processors, as runtimes.

``c-size`` is C for size on this computer. ``c-sanitized`` and ``c-size-sanitized`` stop at errors
of memory and at undefined behaviour. ``c-arm``, ``c-size-powerpc`` ... are built by cross
compilers and run in emulators, which `make tools` installs. So
``python -m devtools.differential --targets c-powerpc`` compares a big-endian machine with the
interpreter, its snapshots included.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

from fsmkit.codegen.c.options import Options
from fsmkit.testing.harness.c import HERE, OPTIONS, Processor, run_many
from fsmkit.testing.harness.harness import Harness, Runtime

PROCESSORS: Mapping[str, Processor] = {
    "i386": Processor(("i686-linux-gnu-gcc", "-static", "-msse2", "-mfpmath=sse"), ("qemu-i386",)),
    "arm": Processor(("arm-linux-gnueabihf-gcc", "-static"), ("qemu-arm",)),
    "powerpc": Processor(("powerpc-linux-gnu-gcc", "-static"), ("qemu-ppc",)),
}
"""All have 32 bits. i386 aligns 64 bits to 4 bytes; powerpc is big-endian.

The x87 registers of i386 keep more digits than a `double`, so its C is compiled for SSE.
"""
FORMS: Mapping[str, Options] = {"c": OPTIONS, "c-size": replace(OPTIONS, is_small=True)}


SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")


def _runtime(name: str, form: str, processor: Processor) -> Harness:
    return Runtime(name, partial(run_many, options=FORMS[form], processor=processor))


SMALL = _runtime("c-size", "c-size", HERE)
"""C for size on this computer."""
SANITIZED: Mapping[str, Harness] = {
    name: _runtime(name, form, Processor(("gcc", *SANITIZERS)))
    for form in FORMS
    for name in [f"{form}-sanitized"]
}
"""C on this computer that ends with an error of memory or of undefined behaviour."""
CROSS: Mapping[str, Harness] = {
    f"{form}-{processor}": _runtime(f"{form}-{processor}", form, PROCESSORS[processor])
    for form in FORMS
    for processor in PROCESSORS
}
