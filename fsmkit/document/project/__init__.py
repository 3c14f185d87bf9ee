"""The project file: where charts are looked for, which rules count, and what verbs do by default.

``fsmkit.toml``, or the table ``tool.fsmkit`` of ``pyproject.toml``; of a file the nearest in its
folder or above it counts.
"""

from fsmkit.document.project.files import project_of, resolved
from fsmkit.document.project.policy import with_levels
from fsmkit.document.project.project import Project

__all__ = ["Project", "project_of", "resolved", "with_levels"]
