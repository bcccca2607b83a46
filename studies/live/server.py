# SPDX-License-Identifier: BSD-3-Clause
"""docs/software/telemetry_server.c for the runs of this study."""

from __future__ import annotations

import socket
import subprocess
from pathlib import Path

from fluxproof.checkout import ROOT


def build_server(folder: Path) -> Path:
    """The server, compiled."""
    code, made = ROOT / "docs" / "software" / "telemetry_server.c", folder / "telemetry_server"
    subprocess.run(["cc", "-O2", "-Wall", "-Wextra", "-Werror", code, "-o", made], check=True)
    return made


def free_port() -> int:
    """A port that nobody listens at."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]
