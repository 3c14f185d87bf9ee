"""``python -m devtools.release [OUT]``: build a release, and try each part in a clean environment.

``make graphviz`` comes first: the packages include Graphviz as WebAssembly.
``OUT`` (default ``build/release``) receives the wheel, the source distribution, the site and the
package of the VS Code extension. The wheel and the source distribution are installed into new
environments, in which a newcomer's commands run. Nothing is published.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import urllib.request
import venv
from collections.abc import Sequence
from pathlib import Path

from devtools.site.__main__ import build as build_site

ROOT = Path(__file__).parents[1]
EXTENSION = ROOT / "editors" / "vscode"
NEWCOMER = (
    ("new", "gate.yaml"),
    ("check", "gate.yaml"),
    ("compile", "gate.yaml", "--out", "generated"),
    ("compile", "gate.yaml", "--target", "python", "--out", "generated"),
    ("run", "gate.yaml", "--events", ""),
    ("convert", "gate.yaml", "--to", "scxml"),
    ("new", "--examples", "examples"),
    ("check", "examples/gate/gate.system.yaml"),
    ("test", "examples/gate"),
)
"""The commands of fsmkit that run in a clean environment."""


class ReleaseError(Exception):
    """A step of the release failed."""


def main(out: Path) -> int:
    """Build all parts and try them; return 0 if each works."""
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    try:
        wheel, source = build_packages(out)
        try_package(wheel)
        try_package(source)
        if build_site(out / "site"):
            raise ReleaseError("Sphinx reported errors: see above")
        build_extension(out)
    except ReleaseError as error:
        print(f"error: {error}", file=sys.stderr)  # noqa: T201
        return 1
    for part in sorted(out.iterdir()):
        files = [part] if part.is_file() else [each for each in part.rglob("*") if each.is_file()]
        size = sum(each.stat().st_size for each in files)
        print(f"{part.name:32} {size / 1000:10,.0f} kB, {len(files)} files")  # noqa: T201
    return 0


def build_packages(out: Path) -> tuple[Path, Path]:
    """Build the wheel and the source distribution twice; both wheels must have equal bytes."""
    changed = _run(["git", "log", "-1", "--format=%ct"], ROOT).strip()
    environment = {**os.environ, "SOURCE_DATE_EPOCH": changed}
    with tempfile.TemporaryDirectory() as again:
        for folder in (str(out), again):
            _run([sys.executable, "-m", "build", "--outdir", folder], ROOT, environment)
        (wheel,), (source,) = out.glob("*.whl"), out.glob("*.tar.gz")
        if wheel.read_bytes() != (Path(again) / wheel.name).read_bytes():
            raise ReleaseError("two builds of the wheel differ: the build reads a clock or a path")
    _run([sys.executable, "-m", "twine", "check", "--strict", str(wheel), str(source)], ROOT)
    return wheel, source


def try_package(package: Path) -> None:
    """Install a package into a new environment, and run the commands of a newcomer there.

    The picture is drawn by the bundled Graphviz: its path has no program of the machine.
    """
    with tempfile.TemporaryDirectory() as created:
        folder = Path(created)
        venv.create(folder / "venv", with_pip=True)
        binaries = folder / "venv" / "bin"
        keep = ("HOME", "LANG", "PIP_INDEX_URL", "PIP_CONFIG_FILE", "SSL_CERT_FILE")
        environment = {name: os.environ[name] for name in keep if name in os.environ}
        environment["PATH"] = os.pathsep.join((str(binaries), "/usr/bin", "/bin"))
        _run([str(binaries / "pip"), "install", "--quiet", str(package)], folder, environment)
        fsmkit = str(binaries / "fsmkit")
        for arguments in NEWCOMER:
            _run([fsmkit, *arguments], folder, environment)
        _try_page([fsmkit, "serve", "gate.yaml", "--json"], folder, environment)
        _run([fsmkit, "draw", "gate.yaml", "--out", "gate.svg"], folder, {"PATH": str(binaries)})
    print(f"{package.name}: installed, {len(NEWCOMER) + 2} verbs tried")  # noqa: T201


def _try_page(command: Sequence[str], folder: Path, environment: dict[str, str]) -> None:
    """Start the server of the page, request the page, and stop the server."""
    with subprocess.Popen(
        command,
        cwd=folder,
        env=environment,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    ) as server:
        try:
            text = ""
            for line in server.stdout or ():
                text += line
                if line == "}\n":
                    break
            address = json.loads(text)["address"]
            with urllib.request.urlopen(address, timeout=60) as page:  # noqa: S310
                if b"<html" not in page.read():
                    raise ReleaseError("`fsmkit serve` sends no page")
        finally:
            server.terminate()


def build_extension(out: Path) -> None:
    """Build the package of the VS Code extension in a copy of its folder, and run its tests."""
    npm = shutil.which("npm")
    if npm is None:
        raise ReleaseError("the extension needs npm, which is missing: `make tools` installs it")
    with tempfile.TemporaryDirectory() as created:
        copy = Path(created) / "editors" / "vscode"
        ignored = shutil.ignore_patterns("node_modules", "dist", "out")
        shutil.copytree(EXTENSION, copy, ignore=ignored)
        (Path(created) / "fsmkit").symlink_to(ROOT / "fsmkit")
        shutil.copy(ROOT / "LICENSE", created)
        environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
        for arguments in (("ci",), ("test",), ("run", "package")):
            _run([npm, *arguments], copy, environment)
        shutil.copy(copy / "fsmkit.vsix", out)


def _run(command: Sequence[str], folder: Path, environment: dict[str, str] | None = None) -> str:
    """Run a command; return its output, or raise `ReleaseError` with its output."""
    done = subprocess.run(
        command, cwd=folder, env=environment, check=False, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip
    if done.returncode:
        raise ReleaseError(f"`{' '.join(command)}` ended with {done.returncode}:\n{done.stdout}")
    return done.stdout


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1] if len(sys.argv) > 1 else "build/release").resolve()))
