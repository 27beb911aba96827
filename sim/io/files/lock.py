"""A lock on an output folder: two commands never write to one folder at the same time.

The second command fails at once with InputError. On systems and file systems without such locks, nothing is locked.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from contextvars import ContextVar
from pathlib import Path

from scenarios.errors import InputError
from sim.io.files.atomic import write_error

# folders whose lock an enclosing block of this thread holds
_held: ContextVar[frozenset[Path]] = ContextVar("held", default=frozenset())


@contextmanager
def lock_folder(root: Path) -> Iterator[None]:
    """Creates the folder `root` and holds its lock for the block; InputError at once if somebody else holds it."""
    made = [p for p in (root, *root.parents) if not p.exists()]
    try:
        with _lock(root):
            token = _held.set(_held.get() | {root.resolve()})
            try:
                yield
            finally:
                _held.reset(token)
                with suppress(OSError):  # only who holds the lock may remove what others would lock
                    for folder in made:
                        folder.rmdir()
    except OSError as error:
        raise write_error(root, error) from error


def hold_lock(root: Path) -> AbstractContextManager[None]:
    """Returns `lock_folder(root)`, or a block without effect inside one of this thread for the same folder."""
    return nullcontext() if root.resolve() in _held.get() else lock_folder(root)


@contextmanager
def _lock(root: Path) -> Iterator[None]:
    try:
        import fcntl
    except ImportError:
        root.mkdir(parents=True, exist_ok=True)
        yield
        return
    while True:
        root.mkdir(parents=True, exist_ok=True)
        try:
            descriptor = os.open(root, os.O_RDONLY)
        except FileNotFoundError:  # removed by who held its lock
            continue
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(descriptor)
            raise InputError(
                file=root, got="another run that writes here", expected="one at a time",
                remedy="wait, or choose another --out",
            ) from None  # fmt: skip
        except OSError:  # NFS cannot lock folders
            break
        if _is_folder(descriptor, root):
            break
        os.close(descriptor)
    try:
        yield
    finally:
        os.close(descriptor)


# Whoever held the lock may have removed the folder, and another may stand at its path now.
def _is_folder(descriptor: int, root: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), os.stat(root))
    except FileNotFoundError:
        return False
