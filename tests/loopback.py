"""A dask cluster of separate processes on loopback: a scheduler, and workers that can be killed one by one."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from tests.processes import ROOT

PATIENCE = 60.0  # s until a process must listen


class Loopback:
    """State: the processes; `workers` in the order of their start."""

    def __init__(self, folder: Path, **env: str) -> None:
        self.folder = folder
        self.workers: list[subprocess.Popen[bytes]] = []
        told = folder / "scheduler.json"
        words = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(told)]
        self.scheduler = self._start("scheduler", words, **env)
        self.address = self._told(told)

    def add_worker(self, *words: str, threads: int = 1) -> subprocess.Popen[bytes]:
        """One more worker, given more words, which nobody starts again when it dies."""
        more = ["--nthreads", str(threads), "--no-nanny", "--no-dashboard", *words]
        self.workers.append(self._start("worker", [self.address, "--host", "127.0.0.1", *more], PYTHONPATH=str(ROOT)))
        return self.workers[-1]

    def end(self) -> None:
        """End all processes."""
        for process in [*self.workers, self.scheduler]:
            process.kill()
            process.wait()

    def _start(self, what: str, words: list[str], **env: str) -> subprocess.Popen[bytes]:
        threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
        with (self.folder / f"{what}-{len(self.workers)}.log").open("wb") as log:
            return subprocess.Popen(
                [sys.executable, "-m", f"distributed.cli.dask_{what}", *words],
                env={**os.environ, **threads, **env}, stdout=log, stderr=log, cwd=self.folder,
            )  # fmt: skip

    def _told(self, file: Path) -> str:
        """The address that the scheduler writes once it listens."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end and self.scheduler.poll() is None:
            with suppress(FileNotFoundError, json.JSONDecodeError):
                return str(json.loads(file.read_text())["address"])
            time.sleep(0.05)
        self.scheduler.kill()
        raise RuntimeError(f"no scheduler: see {self.folder}")


@contextmanager
def loopback(folder: Path, workers: int = 2, *words: str, **env: str) -> Iterator[Loopback]:
    """A cluster of so many workers, given the words, ended with the block; logs in the folder; env: the scheduler's."""
    cluster = Loopback(folder, **env)
    try:
        for _ in range(workers):
            cluster.add_worker(*words)
        yield cluster
    finally:
        cluster.end()
