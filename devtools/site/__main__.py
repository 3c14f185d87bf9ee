"""``python -m devtools.site OUT``: build the site of this version; warnings are errors.

``OUT`` has a folder for each minor release, and ``stable``, a copy of the newest. Folders of other
versions are kept. Every page lists the versions, including later ones.
"""

from __future__ import annotations

import json
import re
import shutil
import sys
import tempfile
from pathlib import Path

from sphinx.cmd.build import main

import fsmkit
from devtools.site.sources import write_sources

VERSION = re.compile(r"\d+\.\d+")
FIRST = """<!doctype html><meta charset="utf-8"><title>fsmkit</title>
<meta http-equiv="refresh" content="0; url=stable/index.html"><a href="stable/index.html">fsmkit</a>
"""


def build(out: Path) -> int:
    """Build the site of this version below a folder; return the exit code of Sphinx."""
    minor = fsmkit.__version__.rpartition(".")[0]
    with tempfile.TemporaryDirectory() as folder:
        write_sources(Path(folder))
        options = ["-q", "-W", "--keep-going", "-b", "html", "-d", f"{folder}/.doctrees"]
        code = int(main([*options, folder, str(out / minor)]))
    if code == 0:
        index(out)
    return code


def index(out: Path) -> None:
    """Write the common files: the list of versions, ``stable`` and the first page."""
    found = (path.name for path in out.iterdir() if VERSION.fullmatch(path.name))
    versions = sorted(found, key=lambda name: [int(part) for part in name.split(".")], reverse=True)
    shutil.rmtree(out / "stable", ignore_errors=True)
    shutil.copytree(out / versions[0], out / "stable")
    listed = json.dumps(["stable", *versions])
    (out / "versions.js").write_text(f"const versions = {listed};\n", encoding="utf-8")
    (out / "index.html").write_text(FIRST, encoding="utf-8")


if __name__ == "__main__":
    sys.exit(build(Path(sys.argv[1] if len(sys.argv) > 1 else "build/site")))
