# SPDX-License-Identifier: BSD-3-Clause
"""Work on all cores of this machine or on a cluster: dask.distributed, with progress and with workers that may die."""

from __future__ import annotations

import contextlib
import itertools
import signal
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import dask.config
from distributed import CancelledError, Client, KilledWorker, LocalCluster, as_completed
from distributed.utils import LoopRunner

from fluxproof.fleet.watch import Watch

AHEAD = 4  # items per worker that wait at the scheduler; more would only take its memory
DEATHS = 10  # workers that one item may take with it before it is suspected
EVERY_S = 10.0  # between lines of progress where the line cannot be updated
CONNECT_S = 15.0
LOST = "600s"  # without a worker before its place is given up
RESTART_S = 5.0  # of a worker that has died
SETTINGS = {
    "distributed.scheduler.allowed-failures": DEATHS,
    "distributed.scheduler.worker-saturation": 1.0,  # nothing waits at a worker, and dies with it
    "distributed.deploy.lost-worker-timeout": LOST,  # by default, a slow restart loses the worker for good
    "distributed.comm.timeouts.connect": f"{CONNECT_S:g}s",
    "distributed.admin.large-graph-warning-threshold": "1GB",
    "distributed.worker.memory.target": False,  # nothing is kept on workers that could be spilled
    "distributed.worker.memory.spill": False,
    "distributed.worker.profile.enabled": False,  # it keeps every second of the last hour, a megabyte each
}


class EngineError(ValueError):
    """No engine: one line says why."""


class Lost:
    """In place of a result: the item took all its workers with it, the cluster was lost, or the time was up.

    final: it is not tried once more.
    """

    def __init__(self, reason: str, final: bool = False):
        self.reason, self.final = reason, final


class Engine:
    """Processes of one thread each, by default one for each core, or the workers of a scheduler.

    with Engine(workers=2) as engine:
        for item, result in engine.each(function, items):
            ...

    limit_s: the most that one item may take; its worker is then started again, and the others go on.
    """

    def __init__(self, workers: int | None = None, scheduler: str | None = None, limit_s: float | None = None):
        self.workers, self.scheduler, self.limit_s = workers, scheduler, limit_s
        self.cluster: LocalCluster | None = None
        self.client: Client | None = None
        self.runner: LoopRunner | None = None

    def __enter__(self) -> Engine:
        self.settings, self.main = dask.config.set(SETTINGS), _Main()
        try:
            if self.scheduler is None:
                self.runner = _deaf_loop()
                self.cluster = LocalCluster(
                    loop=self.runner.loop,
                    n_workers=self.workers, threads_per_worker=1, processes=True, memory_limit=0,
                    dashboard_address="127.0.0.1:0", silence_logs=50,
                )  # fmt: skip
            self.client = Client(self.cluster or self.scheduler, timeout=CONNECT_S)
        except (OSError, TimeoutError, ValueError) as error:
            self.__exit__()
            raise EngineError(f"--scheduler {self.scheduler}: no connection: {error}") from None
        return self

    def __exit__(self, kind=None, *_):
        if kind is None and self.client and self.cluster:
            self._wait_for_restarts(len(self.cluster.workers))
        for part in (self.client, self.cluster):
            if part is not None:
                part.close()
        if self.runner is not None:
            self.runner.stop()
        self.main.restore()
        self.settings.__exit__(None, None, None)

    def _connected(self) -> Any:
        """The client inside ``with``; Any: it is not asynchronous and answers at once, which its types do not say."""
        assert self.client is not None
        return self.client

    @property
    def dashboard(self) -> str:
        """Address of the Dask dashboard."""
        return self._connected().dashboard_link or ""

    def _wait_for_restarts(self, workers: int) -> None:
        """Wait until all workers are there: distributed cannot end one that is just being started again.

        Its own ``wait_for_workers`` replaces the cluster's list of workers, and a worker that is reported gone after
        that ends the cluster with a KeyError.
        """
        deadline = time.monotonic() + RESTART_S
        while len(self._connected().nthreads()) < workers and time.monotonic() < deadline:
            time.sleep(0.1)

    def cores(self) -> int:
        """Threads of all workers, at least 1."""
        return max(sum(self._connected().nthreads().values()), 1)

    def each(self, function: Callable, items: Iterable) -> Iterator[tuple]:
        """(item, result) in the order in which they end; an item that took its workers with it gives Lost.

        An exception of the function is raised here.
        """
        suspects = []
        for item, result in self._ended(function, items):
            if isinstance(result, Lost) and not result.final:
                suspects.append(item)
            else:
                yield item, result
        for item in suspects:  # alone, as a worker takes with it whatever waited beside the cause
            yield from self._ended(function, [item])

    def _ended(self, function, items) -> Iterator[tuple]:
        client, waiting, running = self._connected(), iter(items), {}
        ended = as_completed(with_results=False)

        def more(count):
            for item in itertools.islice(waiting, count):
                future = client.submit(function, item, pure=False)
                running[future.key] = item, future
                ended.add(future)

        def give_up(key):
            if found := running.get(key):
                found[1].cancel(force=True)

        more(AHEAD * self.cores())
        with Watch(client, self.limit_s, give_up) if self.limit_s else contextlib.nullcontext():
            for future in ended:
                item, _ = running.pop(future.key)
                try:
                    result = future.result()
                except KilledWorker:
                    result = Lost("its worker process ended repeatedly, perhaps for lack of memory")
                except CancelledError:
                    result = Lost(f"took longer than {self.limit_s:g} s", final=True)
                future.release()
                more(1)
                yield item, result


def _deaf_loop() -> LoopRunner:
    """A running event loop whose thread, and with it the processes that it starts, does not get Ctrl-C.

    A terminal sends Ctrl-C to the workers too, which would print tracebacks; this process ends them.
    """
    runner = LoopRunner()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # a thread and a process inherit it
    try:
        runner.start()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    return runner


class _Main:
    """The script of this process, unknown to its workers until ``restore``.

    A worker process imports the script that started it, and one without ``if __name__ == "__main__"`` would start the
    command anew in each.  What a worker runs is in modules.
    """

    def __init__(self):
        module = sys.modules["__main__"]
        self.names = vars(module)
        self.file = self.names.pop("__file__", None) if self.names.get("__spec__") is None else None

    def restore(self) -> None:
        if self.file is not None:
            self.names["__file__"] = self.file


def in_parallel(function: Callable, items: list, workers: int | None, what: str) -> Iterator[tuple]:
    """(item, result) of a function over items on cores of this machine, with progress; RuntimeError for a lost item."""
    if not items:
        return
    progress = Progress(len(items), what)
    with Engine(workers) as engine:
        for item, result in engine.each(function, items):
            if isinstance(result, Lost):
                raise RuntimeError(f"{what}: {item}: {result.reason}")
            yield item, result
            progress.step()


class Progress:
    """How many are done, the rate and the time left, on stderr: one line on a terminal, else one every ten seconds."""

    def __init__(self, total: int, what: str, quiet=False, stream=None):
        self.total, self.what, self.quiet = total, what, quiet
        self.stream = stream or sys.stderr
        self.started = self.told = time.monotonic()
        self.done = 0

    def step(self) -> None:
        self.done += 1
        now, terminal = time.monotonic(), self.stream.isatty()
        if self.quiet or (not terminal and now - self.told < EVERY_S and self.done < self.total):
            return
        self.told = now
        self.stream.write(f"\r\x1b[K{self.line()}" if terminal else f"{self.line()}\n")
        if terminal and self.done == self.total:
            self.stream.write("\n")
        self.stream.flush()

    def line(self) -> str:
        """'diagnosed 120 of 1000, 3.1 per second, 4 min 44 s left'"""
        rate = self.done / max(time.monotonic() - self.started, 1e-9)
        left = (self.total - self.done) / rate
        return f"{self.what} {self.done} of {self.total}, {rate:.2g} per second, {duration(left)} left"


def duration(seconds: float) -> str:
    """A duration in the two largest units that it needs."""
    minutes, s = divmod(round(seconds), 60)
    hours, m = divmod(minutes, 60)
    return f"{hours} h {m} min" if hours else f"{m} min {s} s" if m else f"{s} s"
