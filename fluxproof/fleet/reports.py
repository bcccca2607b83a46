# SPDX-License-Identifier: BSD-3-Clause
"""The report of one recording of a fleet, made when somebody asks for it."""

from __future__ import annotations

import contextlib
import functools
import threading
import webbrowser
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import unquote, urlsplit

from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.session import run as session
from fluxproof.fleet.addresses import local, spelled
from fluxproof.fleet.manifest import Entry
from fluxproof.fleet.page import PAGE, REPORTS
from fluxproof.fleet.session import keys_of
from fluxproof.fleet.work import key_of

ONE_AT_A_TIME = threading.Lock()


def make(entries: list[Entry], name: str, out: Path) -> Path:
    """Write OUT/reports/KEY/report.html of a recording by its name; RecordingError if the fleet has none."""
    entry = next((e for e in entries if e.name in (name, spelled(name))), None)
    if entry is None:
        raise RecordingError(f"--report {name}: no recording of this fleet; expected a name as in {PAGE}")
    return _made(entry, key_of(entry.path, entry.drive), out)


def _made(entry: Entry, key: str, out: Path) -> Path:
    folder = Path(out) / REPORTS / key
    report = folder / "report.html"
    with ONE_AT_A_TIME:
        if not report.exists():
            with local(entry.path) as path:
                session([path], load_nominal(entry.drive), folder)
    return report


def server(entries: list[Entry], out: Path) -> ThreadingHTTPServer:
    """A server on this machine alone that shows OUT and makes reports as they are asked for."""
    keys, _ = keys_of(entries)
    by_key = {keys[e.name]: e for e in entries if e.name in keys}

    class Handler(SimpleHTTPRequestHandler):
        def do_GET(self):
            parts = unquote(urlsplit(self.path).path).strip("/").split("/")
            if len(parts) == 3 and parts[0] == REPORTS and parts[2] == "report.html" and parts[1] in by_key:
                try:
                    _made(by_key[parts[1]], parts[1], out)
                except Exception as error:  # bad input, a full disk or a defect costs one report
                    self.send_error(500, explain=str(error))
                    return
            super().do_GET()

        def log_message(self, *_):
            pass

    return _Server(("127.0.0.1", 0), functools.partial(Handler, directory=str(out)))


class _Server(ThreadingHTTPServer):
    def handle_error(self, *_):
        """Nothing: a browser may go while a page is being sent."""


def serve(entries: list[Entry], out: Path) -> None:
    """Show fleet.html in the browser until Ctrl-C."""
    with server(entries, out) as running:
        address = f"http://127.0.0.1:{running.server_port}/{PAGE}"
        print(f"{address}  (Ctrl-C ends)", flush=True)
        webbrowser.open(address)
        with contextlib.suppress(KeyboardInterrupt):
            running.serve_forever()
