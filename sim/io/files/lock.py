"""A lock on an output folder: two commands never write to one folder at the same time.

The second command fails at once with InputError. On systems and file systems without such locks, nothing is locked.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from scenarios.errors import InputError
from sim.io.files.atomic import write_error


@contextmanager
def lock_folder(root: Path) -> Iterator[None]:
    """Create the folder `root` and hold its lock for the length of the block; the block gets None.

    Folders that it created are removed at the end if they are empty. Raises InputError at once, without waiting, if
    another process, or another block of this one, holds the lock. An OSError inside the block is raised as WorkError if
    the disk is full, else as InputError. Systems and file systems without such locks, as NFS, run unlocked.
    """
    made = [p for p in (root, *root.parents) if not p.exists()]
    try:
        root.mkdir(parents=True, exist_ok=True)
        with _lock(root):
            yield
    except OSError as error:
        raise write_error(root, error) from error
    finally:
        with suppress(OSError):
            for folder in made:
                folder.rmdir()


@contextmanager
def _lock(root: Path) -> Iterator[None]:
    try:
        import fcntl
    except ImportError:
        yield
        return
    descriptor = os.open(root, os.O_RDONLY)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(
                file=root,
                got="another run that writes here",
                expected="one at a time",
                remedy="wait, or choose another --out",
            ) from None
        except OSError:  # NFS cannot lock folders
            pass
        yield
    finally:
        os.close(descriptor)
