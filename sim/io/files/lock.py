"""One run at a time in a folder."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from scenarios.errors import InputError
from sim.io.files.atomic import write_error


@contextmanager
def lock_folder(root: Path) -> Iterator[None]:
    """One run at a time in a folder, where the system can tell; a folder made for nothing goes away again."""
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
                got="another run at work here",
                expected="one at a time",
                remedy="wait, or choose another --out",
            ) from None
        except OSError:  # a file system that many machines share may lock no folders: NFS does not
            pass
        yield
    finally:
        os.close(descriptor)
