"""JSON Schemas of all files of fsmkit, for editors, generated from the tables of keys.

The folder `files` holds them as printed. ``python -m fsmkit.editor.schemas`` writes them, and a
test keeps them equal.
"""

from fsmkit.editor.schemas.kinds import FOLDER, KINDS, identified, schema_of, text_of

__all__ = ["FOLDER", "KINDS", "identified", "schema_of", "text_of"]
