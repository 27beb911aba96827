"""The file in which a study lives, for several processes at once, any of which may be killed at any moment.

Optuna's journal, but for three things. Locks are the system's own (fcntl) on bytes of FILE.locks, so that a process
that dies lets go of what it held and others see that its trial has been left: byte 0 while a trial is taken up, byte 1
while a line is written, byte 2 + n while trial n is played. A last line that was not written to its end is cut off
before the next is added. Lines are not flushed to the disk one by one: what a process has written outlives it, if not
a power cut, and a trial writes dozens.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from optuna.storages.journal import JournalFileBackend

LOCKS = ".locks"
TAKING, WRITING, FIRST = 0, 1, 2
HEAD = b'{"op_code":'


class Locks:
    """Locks on bytes of a file. State: the file, open as long as this lives (closing it would let go of all)."""

    def __init__(self, path: Path) -> None:
        self._file = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)

    @contextmanager
    def holding(self, byte: int) -> Iterator[None]:
        """Have a byte alone, waiting for whoever has it."""
        import fcntl

        fcntl.lockf(self._file, fcntl.LOCK_EX, 1, byte)
        try:
            yield
        finally:
            fcntl.lockf(self._file, fcntl.LOCK_UN, 1, byte)

    @contextmanager
    def taking(self) -> Iterator[None]:
        """While trials are looked through and one is taken up."""
        with self.holding(TAKING):
            yield

    def play(self, number: int) -> None:
        """This process is at trial `number`, until `leave`."""
        import fcntl

        fcntl.lockf(self._file, fcntl.LOCK_EX, 1, FIRST + number)

    def leave(self, number: int) -> None:
        """It is no more."""
        import fcntl

        fcntl.lockf(self._file, fcntl.LOCK_UN, 1, FIRST + number)

    def left(self, number: int) -> bool:
        """Is no other process at this trial?"""
        import fcntl

        try:
            fcntl.lockf(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, FIRST + number)
        except OSError:
            return False
        fcntl.lockf(self._file, fcntl.LOCK_UN, 1, FIRST + number)
        return True

    def close(self) -> None:
        """Let go of all."""
        os.close(self._file)


class Journal(JournalFileBackend):
    """A journal that is written under `locks`."""

    def __init__(self, path: Path, locks: Locks) -> None:
        self._path, self._locks = path, locks
        super().__init__(str(path))
        with locks.holding(WRITING):
            self._check()
            self._whole()

    def append_logs(self, logs: list[dict[str, Any]]) -> None:
        """Add lines."""
        text = "".join(json.dumps(log, separators=(",", ":")) + "\n" for log in logs)
        with self._locks.holding(WRITING):
            self._whole()
            with open(self._path, "ab") as file:
                file.write(text.encode())

    def _check(self) -> None:
        """ValueError where the file is something else, of which nothing may be cut off."""
        with open(self._path, "rb") as file:
            head = file.read(len(HEAD))
        if not HEAD.startswith(head):
            raise ValueError("no journal of Optuna")

    def _whole(self) -> None:
        """Cut off a line that has no end."""
        with open(self._path, "r+b") as file:
            size = file.seek(0, os.SEEK_END)
            if size == 0:
                return
            file.seek(size - 1)
            if file.read(1) != b"\n":
                file.seek(0)
                file.truncate(file.read().rfind(b"\n") + 1)
