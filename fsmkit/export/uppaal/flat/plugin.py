"""The exporter ``uppaal-flat``."""

from __future__ import annotations

from fsmkit.export.uppaal.plugin import Uppaal


class Flat(Uppaal):
    """Writes the same without functions."""

    name = "uppaal-flat"
    summary = "UPPAAL and TChecker's importer: the same without functions"
    flat = True


PLUGIN = Flat()
