"""JSON Schemas of all files of fsmkit, for editors; made of the key tables that readers go by.

The folder `files` holds them as they are printed; ``python -m fsmkit.schemas`` writes them anew,
and a test keeps them equal.
"""

from fsmkit.schemas.kinds import FOLDER, KINDS, schema_of, text_of

__all__ = ["FOLDER", "KINDS", "schema_of", "text_of"]
