"""``python -m devtools.site OUT``: build the site into a folder; warnings are errors."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from sphinx.cmd.build import main

from devtools.site.sources import write_sources


def build(out: Path) -> int:
    """Build the site into ``out/html``; return the exit code of Sphinx."""
    with tempfile.TemporaryDirectory() as folder:
        write_sources(Path(folder))
        options = ["-q", "-W", "--keep-going", "-b", "html", "-d", f"{folder}/.doctrees"]
        return int(main([*options, folder, str(out)]))


if __name__ == "__main__":
    sys.exit(build(Path(sys.argv[1] if len(sys.argv) > 1 else "build/site")))
