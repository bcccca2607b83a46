# SPDX-License-Identifier: BSD-3-Clause
"""``fluxproof watch SOURCE --drive drive.toml``: see the drive, and read why it differs, while it runs.

SOURCE is a capture that grows, tcp://HOST:PORT of docs/software/telemetry_server.c, or ``verilator``: the core itself,
simulated, in a clone.
"""

from __future__ import annotations

import argparse
import threading
import time
from pathlib import Path

from fluxproof.diagnosis.whole_drive import load_drive
from fluxproof.dump_capture import with_registers
from fluxproof.quote import put, say
from golden_model.board_registers import board_set
from golden_model.drive_keys import DriveError

VERILATOR = "verilator"
MOST_ROWS = 2_000_000  # 200 MB


def arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the subcommand."""
    parser.add_argument("source", metavar="SOURCE", help="a growing file of packets, tcp://HOST:PORT, or verilator")
    parser.add_argument(
        "--drive", metavar="drive.toml", required=True, help="the drive that the core was configured for"
    )
    parser.add_argument(
        "--registers", metavar="FILE", help="JSON: integers of the registers that differ from drive.toml"
    )
    parser.add_argument("--keep", type=float, default=20.0, metavar="S", help="seconds of rows in memory (default 20)")
    parser.add_argument("--every", type=float, default=10.0, metavar="S", help="renew the explanation (0: off)")
    parser.add_argument("--port", type=int, default=5006, help="of the page (default 5006; 0: any)")
    parser.add_argument("--listen", metavar="ADDRESS", default="127.0.0.1", help="of the page; a token guards others")
    parser.add_argument("--no-page", action="store_true", help="only the line of the state, and the files")
    parser.add_argument("--seconds", type=float, metavar="S", help="end after S seconds")
    parser.add_argument("--csv", metavar="FILE", help="all rows in SI units")
    parser.add_argument("--plotjuggler", metavar="HOST:PORT", help="JSON over UDP for PlotJuggler")


def run(args: argparse.Namespace) -> int:
    """Watch until Ctrl-C or --seconds; 1 if a bit differed from the golden model, DriveError if no row came."""
    from fluxproof.watch.explain import Explainer  # numba and pyarrow take a second
    from fluxproof.watch.live import Live
    from fluxproof.watch.replay import LiveReplay
    from fluxproof.watch.responses import Responses
    from fluxproof.watch.sinks import Csv, PlotJuggler
    from fluxproof.watch.source import source_of

    drive = load_drive(args.drive)
    try:
        register_set = board_set(drive)
    except DriveError as error:
        raise DriveError(f"{args.drive}: {error}") from None
    if args.registers:
        register_set = with_registers(register_set, Path(args.registers))
    rows = round(args.keep / drive.sample_time_s)
    if not 2 <= rows <= MOST_ROWS:
        raise DriveError(f"--keep {args.keep:g}: expected up to {MOST_ROWS * drive.sample_time_s:.0f} s")
    if args.source == VERILATOR:
        from fluxproof.watch.verilated import Verilated

        source = Verilated(drive, register_set)
    else:
        source = source_of(args.source)
    sinks = [Csv(args.csv, drive)] if args.csv else []
    sinks += [PlotJuggler(args.plotjuggler, drive)] if args.plotjuggler else []
    replay = LiveReplay(register_set)
    replay.compile()
    live = Live(source, rows, replay, sinks)
    explainer = Explainer(live, drive, args.drive, register_set, args.every) if args.every > 0 else None
    responses = Responses(live, drive, register_set)
    threads = [threading.Thread(target=live.run)]
    if not args.no_page:
        threads.append(threading.Thread(target=responses.run, args=(live.ending,), daemon=True))
    if explainer is not None:
        threads.append(threading.Thread(target=explainer.run, args=(live.ending,), daemon=True))
    for thread in threads:
        thread.start()
    try:
        _show(args, live, drive, explainer, responses)
    except KeyboardInterrupt:
        pass
    finally:
        live.ending.set()
        threads[0].join()
    put(live.told())
    put(live.replay.told())
    if explainer is not None and explainer.found:
        put(f"explanation: {explainer.found[-1].verdict}: {explainer.found[-1].text}")
    if live.failure is not None:
        raise live.failure
    if not live.total:
        raise DriveError(f"{args.source}: no row has come: {source.why_silent()}")
    return 1 if live.replay.difference else 0


def _show(args, live, drive, explainer, responses) -> None:
    """The page, or a wait; until --seconds have passed or the reader has failed."""
    end = None if args.seconds is None else time.monotonic() + args.seconds
    over = lambda: live.failure is not None or (end is not None and time.monotonic() >= end)  # noqa: E731
    if args.no_page:
        while not over():
            time.sleep(0.1)
        return
    try:
        from fluxproof.watch.page import Scene, view
        from fluxproof.watch.server import serve, token_for
    except ImportError:
        raise DriveError("the page needs bokeh: pip install 'fluxproof[fleet]', or --no-page") from None
    try:
        scene = Scene(live, drive, explainer, responses)
        server, url = serve(lambda doc: view(doc, scene), args.listen, args.port, token_for(args.listen))
    except OSError as error:
        raise DriveError(f"--listen {args.listen} --port {args.port}: {error.strerror or error}") from None
    say(f"watching {args.source}: {url}")
    loop = server.io_loop
    from tornado.ioloop import PeriodicCallback

    PeriodicCallback(lambda: loop.stop() if over() else None, 100).start()
    loop.start()
    server.stop()
