"""Files for supervisors of processes, which start the nodes of a deployment and keep them running.

A deployment comes in, files by name go out. They say how a node is started and restarted, and
nothing of its machines but their names.
"""

from fsmkit.codegen.units.service import Service, services_of
from fsmkit.codegen.units.supervisor import supervisor_files
from fsmkit.codegen.units.systemd import systemd_files

KINDS = {"systemd": systemd_files, "supervisor": supervisor_files}
"""From the name of a supervisor to the function that writes its files."""

__all__ = ["KINDS", "Service", "services_of"]
