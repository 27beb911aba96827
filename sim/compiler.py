"""Compiles kernels: numba's njit, whose cache finds a place on every machine.

numba caches compiled kernels beside their files or in the user's cache folder. In a container neither may be writable,
and numba then refuses to compile. The cache goes to a temporary folder of the user in that case, or is left out. numba
looks at the file of a kernel alone; here, a change of its options, of this module or of what it imports makes it
compile anew, too.
"""

from __future__ import annotations

import hashlib
import os
import stat
import tempfile
import time
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numba
import numpy as np
from numba.core import event

config: Any = numba.config
register: Any = event.register
OWN = hashlib.sha256(Path(__file__).read_bytes()).hexdigest()
NO_CACHE = (
    "kernels are compiled anew in every process: their cache has no place, because neither the installation nor the "
    "home folder nor the temporary folder can be written; set NUMBA_CACHE_DIR to a folder that can"
)


def cached_njit(**options: Any) -> Callable[[Any], Any]:
    """Returns a decorator: numba's njit, whose cache goes to the first place that can be written.

    x / 0 is inf or nan, x // 0 of whole numbers is 0.
    """
    # one error model for all: what np.empty and others compile to depends on it
    options = {"error_model": "numpy", "no_cfunc_wrapper": True, **options}

    def compiled(function: Any) -> Any:
        if not options.get("cache"):
            return numba.njit(**options)(function)
        if not config.CACHE_DIR and not _numba_finds_a_place(os.path.dirname(function.__code__.co_filename)):
            config.CACHE_DIR = temporary_cache() or ""
        try:
            kernel = numba.njit(**options)(function)
        except RuntimeError as error:
            if "cannot cache function" not in str(error):
                raise
            _warn_once()
            return numba.njit(**{**options, "cache": False})(function)
        stored = _stored(kernel)
        stored._source_stamp = (stored._source_stamp, _used_by(function), OWN, repr(sorted(options.items())))
        return kernel

    return compiled


def _stored(kernel: Any) -> Any:
    return getattr(getattr(kernel, "_cache", None), "_cache_file", None)


def _used_by(function: Any) -> str:
    used = hashlib.sha256()
    for name, value in sorted(function.__globals__.items()):
        stored = _stored(value)
        if stored and value.__module__ != function.__module__:
            value = stored._source_stamp
        elif isinstance(value, np.ndarray):
            value = value.tobytes()
        elif not isinstance(value, bool | int | float | tuple | np.generic):
            continue
        used.update(f"{name} {value!r}\n".encode())
    return used.hexdigest()


class _Compiling(event.Listener):
    """Whether numba compiles now (depth above 0), and for how many seconds it has compiled in this process."""

    def __init__(self) -> None:
        self.depth, self.seconds, self._begun = 0, 0.0, 0.0

    def on_start(self, event: Any) -> None:
        if self.depth == 0:
            self._begun = time.perf_counter()
        self.depth += 1

    def on_end(self, event: Any) -> None:
        self.depth -= 1
        if self.depth == 0:
            self.seconds += time.perf_counter() - self._begun


compiling = _Compiling()
register("numba:compile", compiling)


def clock() -> float:
    """Returns the seconds of a clock that stands still while kernels are compiled."""
    return time.perf_counter() - compiling.seconds


if TYPE_CHECKING:  # a kernel is for mypy what numba's own decorator makes of it
    from numba import njit as njit
else:
    njit = cached_njit


@cache
def _numba_finds_a_place(folder: str) -> bool:
    # Without a home, numba's cache folder would be one in the working directory.
    users = os.environ.get("XDG_CACHE_HOME", os.path.join(os.path.expanduser("~"), ".cache"))
    places = [os.path.join(folder, "__pycache__"), *([os.path.join(users, "numba")] if os.path.isabs(users) else [])]
    return any(_can_be_written(Path(place)) for place in places)


def _can_be_written(folder: Path) -> bool:
    existing = next(path for path in (folder, *folder.parents) if path.exists())
    return existing.is_dir() and os.access(existing, os.W_OK | os.X_OK)


def temporary_cache() -> str | None:
    """Returns the user's own folder for caches among the temporary files; None if it is not safe."""
    try:
        user = os.getuid() if hasattr(os, "getuid") else None
        folder = Path(tempfile.gettempdir()) / f"flockscope-kernels-{'' if user is None else user}"
        folder.mkdir(mode=0o700, exist_ok=True)
        facts = folder.lstat()
    except OSError:
        return None
    # Caches hold code: nobody else may put files into the folder.
    own = user is None or (facts.st_uid == user and not facts.st_mode & (stat.S_IWGRP | stat.S_IWOTH))
    return str(folder) if own and stat.S_ISDIR(facts.st_mode) and _can_be_written(folder) else None


@cache
def _warn_once() -> None:
    warnings.warn(NO_CACHE, stacklevel=2)
