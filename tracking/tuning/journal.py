"""The file that holds a study, for several processes at once, any of which may be killed at any time.

Optuna's journal with three differences:

- Locks are system locks (fcntl) on bytes of FILE.locks: byte 0 while a trial is chosen, byte 1 while lines are written,
  byte 2 + n while trial n is played. The system releases the locks of a process that dies, so other processes see that
  its trial was abandoned.
- An incomplete last line is removed before the next line is written.
- Lines are not flushed to the disk one by one. They survive a killed process but not a power cut.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from optuna.storages.journal import JournalFileBackend

SUFFIX = ".locks"  # What the name of the lock file adds to the name of the journal.
CHOOSING, WRITING, FIRST_TRIAL = 0, 1, 2  # Bytes of the lock file.
HEAD = b'{"op_code":'  # How every journal begins.


class TrialLocks:
    """Locks on single bytes of the file `path`, shared by the processes of a search; the file is created if missing.

    State: the open file; closing it, or the end of the process, releases every lock.
    """

    def __init__(self, path: Path) -> None:
        self._file = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)

    @contextmanager
    def locked(self, byte: int) -> Iterator[None]:
        """Holds the lock on a byte (offset in the file) for the time of the context; waits until it is free."""
        import fcntl

        fcntl.lockf(self._file, fcntl.LOCK_EX, 1, byte)
        try:
            yield
        finally:
            fcntl.lockf(self._file, fcntl.LOCK_UN, 1, byte)

    @contextmanager
    def choosing(self) -> Iterator[None]:
        """Holds the lock under which a trial is chosen for the time of the context; waits until it is free."""
        with self.locked(CHOOSING):
            yield

    def hold_trial(self, number: int) -> None:
        """Locks trial `number` (from 0) for this process until `release_trial` or `close`."""
        import fcntl

        fcntl.lockf(self._file, fcntl.LOCK_EX, 1, FIRST_TRIAL + number)

    def release_trial(self, number: int) -> None:
        """Releases this process's lock on trial `number` (from 0); does nothing if it holds none."""
        import fcntl

        fcntl.lockf(self._file, fcntl.LOCK_UN, 1, FIRST_TRIAL + number)

    def is_abandoned(self, number: int) -> bool:
        """Returns True if no other process holds the lock on trial `number` (from 0)."""
        import fcntl

        try:
            fcntl.lockf(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, FIRST_TRIAL + number)
        except OSError:
            return False
        fcntl.lockf(self._file, fcntl.LOCK_UN, 1, FIRST_TRIAL + number)
        return True

    def close(self) -> None:
        """Closes the file and so releases every lock."""
        os.close(self._file)


class LockedJournal(JournalFileBackend):
    """Optuna's journal file at `path`, written under `locks`, without incomplete last lines."""

    def __init__(self, path: Path, locks: TrialLocks) -> None:
        self._path, self._locks = path, locks
        super().__init__(str(path))
        with locks.locked(WRITING):
            self._check_head()
            self._remove_incomplete_line()

    def append_logs(self, logs: list[dict[str, Any]]) -> None:
        """Appends one JSON line per log (a dict); removes an incomplete last line first. No logs append nothing."""
        text = "".join(json.dumps(log, separators=(",", ":")) + "\n" for log in logs)
        with self._locks.locked(WRITING):
            self._remove_incomplete_line()
            with open(self._path, "ab") as file:
                file.write(text.encode())

    def _check_head(self) -> None:
        with open(self._path, "rb") as file:
            head = file.read(len(HEAD))
        if not HEAD.startswith(head):
            raise ValueError("no journal of Optuna")

    def _remove_incomplete_line(self) -> None:
        with open(self._path, "r+b") as file:
            size = file.seek(0, os.SEEK_END)
            if size == 0:
                return
            file.seek(size - 1)
            if file.read(1) != b"\n":
                file.seek(0)
                file.truncate(file.read().rfind(b"\n") + 1)
