"""``python -m fsmkit.editor.schemas`` writes the files of the folder ``files`` anew."""

from __future__ import annotations

import fsmkit
from fsmkit.editor.schemas.kinds import FOLDER, KINDS, text_of

for kind in KINDS:
    text = text_of(kind, fsmkit.__version__)
    (FOLDER / f"{kind}.json").write_text(text, encoding="utf-8")
