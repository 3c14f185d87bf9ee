"""C for speed, as the tests run it: it is covered as a runtime of its own."""

from __future__ import annotations

from fsmkit.codegen.c.small.plugin import AimedC

PLUGIN = AimedC("c-speed", is_fast=True)
