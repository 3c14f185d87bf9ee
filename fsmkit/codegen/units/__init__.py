"""Files for process supervisors, which start the nodes of a deployment and restart them.

The input is a deployment, the output files by name. They contain how a node is started and
restarted, but only the names of its machines.
"""

from fsmkit.codegen.units.service import Service, services_of
from fsmkit.codegen.units.supervisor import supervisor_files
from fsmkit.codegen.units.systemd import systemd_files

KINDS = {"systemd": systemd_files, "supervisor": supervisor_files}
"""The function that returns the files of each supervisor."""

__all__ = ["KINDS", "Service", "services_of"]
