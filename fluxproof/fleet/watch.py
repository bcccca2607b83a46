# SPDX-License-Identifier: BSD-3-Clause
"""The limit of time of each item: who runs longer loses its worker process, whatever blocks it."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable
from typing import Any

from distributed import Client

LOOKS = 10  # within the limit
LOOK_S = (0.05, 2.0)  # shortest and longest time between two of them


def kill(addresses, dask_worker) -> None:
    """End the worker process of a nanny, in the nanny, unless it already is another one, which is just starting."""
    if dask_worker.worker_address in addresses:
        os.kill(dask_worker.pid, getattr(signal, "SIGKILL", signal.SIGTERM))


class Watch(threading.Thread):
    """Looks which item runs at which worker and for how long; beyond the limit the worker is started again.

    give_up: called before with the key of the item, so that no other worker gets it.
    """

    def __init__(self, client: Client, limit_s: float, give_up: Callable[[str], None]):
        super().__init__(daemon=True)
        # Any: a client that is not asynchronous answers at once, which its types do not say.
        self.client: Any = client
        self.limit_s, self.give_up = limit_s, give_up
        self.since: dict[tuple[str, str], float] = {}  # when a (worker, key) was first seen to run
        self.doomed: set[str] = set()  # workers that are to be killed, until they are gone
        self.ended = threading.Event()

    def __enter__(self) -> Watch:
        self.start()
        return self

    def __exit__(self, *_):
        self.ended.set()
        self.join()

    def run(self) -> None:
        pause = min(max(self.limit_s / LOOKS, LOOK_S[0]), LOOK_S[1])
        while not self.ended.wait(pause):
            try:
                self.look(time.monotonic())
            except Exception:  # no answer this time, such as of a scheduler that is closing: the next look may get one
                continue

    def look(self, now: float) -> None:
        """End the workers whose items run beyond the limit."""
        threads = self.client.nthreads()
        # What waits at a worker for another item to end has no time running.
        running = [(w, key) for w, keys in self.client.processing().items() for key in self._first(w, keys, threads)]
        self.since = {pair: self.since.get(pair, now) for pair in running}
        late = [(worker, key) for (worker, key), at in self.since.items() if now - at > self.limit_s]
        for worker, key in late:
            self.doomed.add(worker)
            self.give_up(key)
        self.doomed &= set(threads)  # one that is started again has another address
        if self.doomed:
            # The worker itself may be deaf; its nanny, a process of its own, kills it and starts it again.
            doomed = sorted(self.doomed)
            self.client.run(kill, doomed, workers=doomed, nanny=True, on_error="ignore")

    def _first(self, worker, keys, threads) -> list[str]:
        """The keys that a worker has had longest, one for each of its threads."""
        ordered = sorted(keys, key=lambda key: self.since.get((worker, key), float("inf")))
        return ordered[: threads.get(worker, 1)]
