"""The project file: search folders of charts, levels of rules, and defaults of verbs.

It is ``fsmkit.toml``, or the table ``tool.fsmkit`` of ``pyproject.toml``. A file uses the nearest
one in its folder or above.
"""

from fsmkit.document.project.files import project_of, resolve_name
from fsmkit.document.project.policy import with_levels
from fsmkit.document.project.project import Project

__all__ = ["Project", "project_of", "resolve_name", "with_levels"]
