"""``python -m devtools.graphviz_module PACKAGE``: bundle Graphviz as WebAssembly with fsmkit.

``PACKAGE`` is the folder of the npm package ``@viz-js/viz``, by default the one that
``make graphviz`` installs below ``build/node``. The module and the names of its imports and exports
are copied to ``fsmkit/chart/drawing/graphviz``. The wheel and the source distribution include them.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

from fsmkit.chart.drawing.graphviz.bundled import MODULE, NAMES

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "build" / "node" / "node_modules" / "@viz-js" / "viz"
EXTRACT = """
const compile = WebAssembly.instantiate;
WebAssembly.instantiate = (bytes, imports) => {
  require("fs").writeFileSync(process.argv[2], Buffer.from(bytes));
  return compile(bytes, imports);
};
import(process.argv[1])
  .then((viz) => viz.instance())
  .then((one) => console.log(one.graphvizVersion));
"""
"""The package holds the module as a string of its own code; starting it yields the bytes."""
IMPORTS = re.compile(r"var wasmImports=\{([^}]*)\}")
EXPORT = re.compile(r'Module\["_(\w+)"\]=wasmExports\["([^"]+)"\]')
MEMORY = re.compile(r'wasmMemory=wasmExports\["([^"]+)"\]')
CONSTRUCTORS = re.compile(r'TTY\.init\(\);wasmExports\["([^"]+)"\]\(\)')


def main(package: Path) -> int:
    """Copy the module of a package; print the version of Graphviz and the size in bytes."""
    script = (package / "lib" / "backend.js").read_text(encoding="utf-8")
    names = {"imports": _imports(script), "exports": _exports(script)}
    viz = (package / "dist" / "viz.js").as_uri()
    command = ["node", "--eval", EXTRACT, viz, str(MODULE)]
    version = subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
    NAMES.write_text(json.dumps(names, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    print(f"Graphviz {version}: {MODULE.stat().st_size:,} bytes")  # noqa: T201
    return 0


def _imports(script: str) -> dict[str, str]:
    return dict(re.findall(r"(\w+):(\w+)", _first_group(IMPORTS, script)))


def _exports(script: str) -> dict[str, str]:
    own = {
        "memory": _first_group(MEMORY, script),
        "constructors": _first_group(CONSTRUCTORS, script),
    }
    return {**dict(EXPORT.findall(script)), **own}


def _first_group(pattern: re.Pattern[str], script: str) -> str:
    """Return the first group of a match in the script; exit with a message if none matches."""
    found = pattern.search(script)
    if found is None:
        raise SystemExit(f"the package has another form: nothing matches {pattern.pattern}")
    return found[1]


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]) if len(sys.argv) > 1 else PACKAGE))
