# SPDX-License-Identifier: BSD-3-Clause
"""`make lock`: writes requirements.lock and requirements/*.txt from the lists in pyproject.toml.

One resolution for every group, Python version and system goes to requirements.lock, with hashes.
requirements/GROUP.txt lists what a group takes of it, so two groups never disagree about a version; it has no hashes,
as the installation reads those from requirements.lock.  Only installer.txt has its own: pip installs that one alone.

usage: python scripts/setup/lock.py UV [--keep]     --keep: leave versions as they are where they still fit
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

try:
    import tomllib
except ModuleNotFoundError:  # Python 3.10
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[2]
LOCK, FOLDER = ROOT / "requirements.lock", ROOT / "requirements"
INSTALLER = "installer"
# No address of a package index may enter the files.
OPTIONS = ["--universal", "--python-version", "3.10", "--no-header", "--no-annotate", "--no-emit-index-url"]
OPTIONS += ["--no-emit-find-links", "--quiet"]


def groups() -> dict[str, list[str]]:
    """{group: requirements}; "run" is what the installed package needs."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    extras = project["project"]["optional-dependencies"]
    return {"run": project["project"]["dependencies"], **extras, **project["dependency-groups"]}


def resolve(uv: str, inputs: list[Path], output: Path, *options: str) -> None:
    subprocess.run([uv, "pip", "compile", *OPTIONS, *options, "-o", str(output), *map(str, inputs)], check=True)


def main(uv: str, keep: bool) -> None:
    with tempfile.TemporaryDirectory(dir=ROOT, prefix=".lock.") as folder:
        inputs = {}
        for name, requirements in groups().items():
            inputs[name] = Path(folder, f"{name}.in")
            inputs[name].write_text("\n".join(requirements) + "\n")
        lock = Path(folder, LOCK.name)
        if keep:  # uv prefers the versions of the file that it is to write
            lock.write_text(LOCK.read_text())
        resolve(uv, list(inputs.values()), lock, "--generate-hashes")
        taken = {}
        for name, path in inputs.items():
            taken[name] = Path(folder, f"{name}.txt")
            hashes = ["--generate-hashes"] if name == INSTALLER else []
            resolve(uv, [path], taken[name], "--constraints", str(lock), *hashes)
        FOLDER.mkdir(exist_ok=True)
        for old in FOLDER.glob("*.txt"):
            if old.stem not in taken:
                old.unlink()
        for name, path in taken.items():
            path.replace(FOLDER / f"{name}.txt")
        lock.replace(LOCK)


if __name__ == "__main__":
    main(sys.argv[1], "--keep" in sys.argv[2:])
