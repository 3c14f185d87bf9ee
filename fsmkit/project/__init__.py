"""The project file: where charts are looked for, which rules count, and what verbs do by default.

``fsmkit.toml``, or the table ``tool.fsmkit`` of ``pyproject.toml``; of a file the nearest in its
folder or above it counts.
"""

from fsmkit.project.files import project_of, resolved
from fsmkit.project.policy import with_levels
from fsmkit.project.project import Project

__all__ = ["Project", "project_of", "resolved", "with_levels"]
