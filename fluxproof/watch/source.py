# SPDX-License-Identifier: BSD-3-Clause
"""Where the bytes of the telemetry come from: a file that grows, or a server that sends what its DMA stores."""

from __future__ import annotations

import os
import socket
import time
from typing import Protocol

from fluxproof.diagnosis.replay.telemetry import MAGIC
from fluxproof.quote import say
from golden_model.drive_keys import DriveError

CHUNK = 1 << 18
IDLE_S = 0.02
RETRY_S, MOST_RETRY_S = 0.2, 2.0
TCP = "tcp://"


class Source(Protocol):
    """A stream of bytes that may break and be resumed."""

    breaks: int  # how often it began anew: bytes before and after do not belong together

    def read(self) -> bytes:
        """What has come, up to CHUNK bytes; empty after a short wait for nothing."""
        ...

    def close(self) -> None: ...

    def why_silent(self) -> str:
        """Why no row has come, of what this source knows; what was expected."""
        ...


def source_of(text: str) -> Source:
    """The source that the command line names."""
    if not text.startswith(TCP):
        return GrowingFile(text)
    host, _, port = text[len(TCP) :].rpartition(":")
    if not host or not port.isdigit() or not 0 < int(port) < 65536:
        raise DriveError(f"{text}: expected {TCP}HOST:PORT")
    return Tcp(host.strip("[]"), int(port))


class GrowingFile:
    """A capture that another program writes; replaced or shortened, it is read from its begin again."""

    def __init__(self, path: str) -> None:
        self.path, self.breaks, self.at = path, 0, 0
        try:
            self.file = open(path, "rb", buffering=0)  # noqa: SIM115 - closed by close()
        except OSError as error:
            raise DriveError(f"{path}: cannot be read: {error.strerror or error}") from None
        if not self.file.seekable():  # a pipe: what is read of it is gone
            return
        if self.file.read(len(MAGIC)) == MAGIC:
            self.file.close()
            raise DriveError(
                f"{path}: this is a dump, a recording that has ended: diagnose it with 'fluxproof diagnose'; watch "
                "expects the raw capture, the packets as the DMA stores them"
            )
        self.file.seek(0)

    def read(self) -> bytes:
        data = self.file.read(CHUNK) or b""
        self.at += len(data)
        if data:
            return data
        time.sleep(IDLE_S)
        try:
            now = os.stat(self.path)
        except OSError:
            return b""
        mine = os.fstat(self.file.fileno())
        if now.st_size < self.at or (now.st_dev, now.st_ino) != (mine.st_dev, mine.st_ino):
            self.file.close()
            self.file, self.at = open(self.path, "rb", buffering=0), 0  # noqa: SIM115
            self.breaks += 1
        return b""

    def close(self) -> None:
        self.file.close()

    def why_silent(self) -> str:
        if not self.at:
            return "the file is empty, expected packets of the core's telemetry: is the capture running?"
        return f"none of its {self.at:,} bytes is a packet, expected the core's telemetry as the DMA stores it"


class Tcp:
    """A connection that is made again when it breaks, at intervals up to MOST_RETRY_S."""

    def __init__(self, host: str, port: int) -> None:
        self.host, self.port, self.breaks = host, port, 0
        self.socket: socket.socket | None = None
        self.wait_s, self.again_at = RETRY_S, 0.0
        self.answered, self.bytes, self.refused = False, 0, ""  # ever; ``refused``: the reason of the last attempt

    def read(self) -> bytes:
        if self.socket is None and not self._connect():
            time.sleep(IDLE_S)
            return b""
        assert self.socket is not None
        try:
            data = self.socket.recv(CHUNK)
        except TimeoutError:
            return b""
        except OSError:
            data = b""
        if not data:
            self.close()
            self.breaks += 1
        self.bytes += len(data)
        return data

    def _connect(self) -> bool:
        if time.monotonic() < self.again_at:
            return False
        try:
            self.socket = socket.create_connection((self.host, self.port), timeout=1.0)
            self.socket.settimeout(0.2)
        except OSError as error:
            if not self.answered and not self.refused:
                say(f"{TCP}{self.host}:{self.port}: nobody answers ({error.strerror or error}); tried until it does")
            self.refused = error.strerror or str(error)
            self.again_at = time.monotonic() + self.wait_s
            self.wait_s = min(2.0 * self.wait_s, MOST_RETRY_S)
            return False
        self.wait_s, self.answered = RETRY_S, True
        return True

    def close(self) -> None:
        if self.socket is not None:
            self.socket.close()
            self.socket = None

    def why_silent(self) -> str:
        if not self.answered:
            return (
                f"nobody answers ({self.refused or 'no attempt has ended'}), expected a telemetry server at this port"
            )
        if not self.bytes:
            return "the server is connected and sends nothing: is the core sampling?"
        return f"none of the {self.bytes:,} bytes is a packet, expected those of docs/software/telemetry_server.c"
