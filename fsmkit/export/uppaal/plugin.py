"""The exporter ``uppaal``."""

from __future__ import annotations

from functools import partial

from fsmkit.export.exporter import ExportedModel, ExportOptions, report_omitted
from fsmkit.system.system import System
from fsmkit.verify.resources.deadline import Stage


class Uppaal:
    """Writes a closed system as a readable network of timed automata."""

    name = "uppaal"
    summary = "UPPAAL: a template for each machine, timers as clocks, queries"
    flat = False

    def export(self, system: System, options: ExportOptions) -> ExportedModel:
        """Follow all macrosteps with open data, then write, within the deadline."""
        work = partial(self._write, system, options)
        return options.deadline.cut_off(Stage.EXPLORING, work)

    def _write(self, system: System, options: ExportOptions) -> ExportedModel:
        from fsmkit.export.transition_system import within_limits
        from fsmkit.export.uppaal.translate import translate
        from fsmkit.export.uppaal.writing import write
        from fsmkit.verify.statespace.closed_system import close

        closed = close(system, untimed=options.untimed, silent=options.silent)
        limited = within_limits(closed, options, "locations")
        network = translate(closed, flat=self.flat, paced=self.flat, progress=limited)
        for property_, query in zip(system.properties, network.queries, strict=False):
            if query.missing:
                report_omitted(property_, query.missing, options.findings)
        figures = {
            "locations": sum(len(template.locations) for template in network.templates),
            "edges": sum(len(template.edges) for template in network.templates),
            "queries": sum(bool(query.formula) for query in network.queries),
        }
        limited(figures["locations"], figures["edges"])
        return ExportedModel(write(network), figures)


PLUGIN = Uppaal()
