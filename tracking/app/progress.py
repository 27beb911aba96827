"""A progress bar on stderr for work that takes longer than two seconds."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterable
from types import TracebackType
from typing import TYPE_CHECKING, Self

from scenarios.errors import printable
from tracking.user_code import raise_if_interrupted

if TYPE_CHECKING:
    from rich.progress import Progress

    from sim.types import Sequence

PATIENCE = 2.0  # s before anything is shown.

PAUSE = 10.0  # s between lines if stderr is no terminal.

SURE_SHARE = 0.05  # of all items: fewer tell nothing of the pace.


def total_frames(sequences: Iterable[Sequence]) -> int | None:
    """Returns the number of frames of all sequences, None if one of them does not know its length."""
    lengths = [sequence.length for sequence in sequences]
    return None if None in lengths else sum(length or 0 for length in lengths)


class ProgressMeter:
    """Counts finished items of a long task and shows the count on stderr. A context manager; its end removes the bar.

    On a terminal a bar appears 2 s after entering, from a thread. Elsewhere `update` prints a line, at most every 10 s.
    """

    def __init__(self, what: str, total: int | None = None) -> None:
        self.what, self.total, self.done, self.item = what, total, 0, ""
        self._bar: Progress | None = None
        self._first: tuple[float, int] | None = None  # when the first items were done, which compile code, and how many
        self._last_line = time.monotonic() + PATIENCE - PAUSE
        self._timer = threading.Timer(PATIENCE, self._show)
        self._lock = threading.Lock()

    def __enter__(self) -> Self:
        self._timer.daemon = True
        self._timer.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._timer.cancel()
        with self._lock:
            self._timer.finished.set()
            if self._bar is not None:
                self._bar.stop()

    def step(self, item: str = "", count: int = 1) -> None:
        """Adds `count` finished items and shows their number. item: name to show, "" for none. Raises KeyboardInterrupt
        after Ctrl-C."""
        self.update(self.done + count, self.total, item)

    def update(self, done: int, total: int | None, item: str = "") -> None:
        """Sets the number of finished items, `done`, and of all items, `total` (None if unknown), and shows them."""
        raise_if_interrupted()
        total = total if total is None or done <= total else None  # a budget can be exceeded
        self.done, self.total, self.item = done, total, printable(item)
        if self._first is None and done:
            self._first = time.monotonic(), done
        if self._bar is not None:
            self._bar.update(self._bar.task_ids[0], completed=done, total=total, item=self.item, left=self._left())
        elif not sys.stderr.isatty() and time.monotonic() - self._last_line > PAUSE:
            self._last_line = time.monotonic()
            words = [f"{self.what}: {done}{'' if total is None else f' of {total}'}", self.item, self._left()]
            print(*filter(None, words), file=sys.stderr)

    def _left(self) -> str:
        """Returns in words how long the rest takes at the pace since the first items, "" if that is unknown."""
        if not self.total or self._first is None or self.done - self._first[1] < SURE_SHARE * self.total:
            return ""
        began, first = self._first
        seconds = (time.monotonic() - began) * (self.total - self.done) / (self.done - first)
        return f"({int(seconds) // 60}:{int(seconds) % 60:02} left)" if seconds >= 1 else ""

    def _show(self) -> None:
        if not sys.stderr.isatty():
            return
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

        with self._lock:
            if self._timer.finished.is_set():
                return
            texts = "{task.description}", "{task.fields[left]}", "{task.fields[item]}"
            what, left, item = (TextColumn(text, markup=False) for text in texts)
            columns = (what, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), left, item)
            bar = Progress(*columns, console=Console(stderr=True), transient=True)
            compiler = sys.modules.get("sim.compiler")  # not imported here, as it imports numba
            shown = "compiling, once" if compiler is not None and compiler.compiling.depth else self.item
            bar.add_task(self.what, completed=self.done, total=self.total, item=shown, left=self._left())
            bar.start()
            self._bar = bar
