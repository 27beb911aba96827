"""Writing so that nothing is ever seen half-written: beside the target, flushed to disk, then renamed."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from uuid import uuid4

from scenarios.errors import FlockscopeError, InputError, WorkError

PARTIAL = ".partial-"
SYNC_THREADS = 8  # files flushed at a time
DISK_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def write_error(path: Path, error: OSError) -> FlockscopeError:
    """What an OSError while writing means to the user."""
    reason = error.strerror or type(error).__name__
    if error.errno in DISK_FULL:
        return WorkError(
            file=path, got=reason, expected="room on the disk", remedy="free some; what was complete is kept"
        )
    return InputError(file=path, got=reason, expected="a folder that can be written", remedy="choose another --out")


@contextmanager
def staged_path(target: Path) -> Iterator[Path]:
    """A partial path beside the target to write to; gone afterwards, and so are folders made for nothing.

    No other writer has it: processes of two machines may have one number.
    """
    partial = target.parent / f"{PARTIAL}{target.name}-{uuid4().hex[:12]}"
    made = [p for p in (target.parent, *target.parent.parents) if not p.exists()]
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        yield partial
    except OSError as error:
        raise write_error(target, error) from error
    finally:
        _remove(partial)
        with suppress(OSError):
            for folder in made:
                folder.rmdir()


def write_file(target: Path, content: bytes) -> None:
    """A file, whole or not at all."""
    with staged_path(target) as partial:
        _write_synced(partial, content)
        os.replace(partial, target)
        _sync_folder(target.parent)


@contextmanager
def new_file(target: Path) -> Iterator[Path]:
    """A path beside the target to write a file to, which takes its place when left well."""
    with staged_path(target) as partial:
        yield partial
        _sync_file(partial)
        os.replace(partial, target)
        _sync_folder(target.parent)


@contextmanager
def new_folder(target: Path, keep: Callable[[], bool] = lambda: False) -> Iterator[Path]:
    """An empty folder beside the target to fill, which takes its place when left well; one that stood there goes.

    keep: whether one that has come to stand there meanwhile shall stay instead.
    """
    with staged_path(target) as partial:
        partial.mkdir()
        yield partial
        _sync_tree(partial)
        if target.exists():
            if keep():
                return
            _remove(target)
        try:
            os.rename(partial, target)
        except OSError:
            if not keep():
                raise
        _sync_folder(target.parent)


def write_folder(target: Path, files: Mapping[str, bytes]) -> None:
    """A folder of files, whole or not at all; one that stood there is replaced."""
    with new_folder(target) as partial:
        for name, content in files.items():
            write_unsynced(partial / name, content)


def write_unsynced(path: Path, content: bytes) -> None:
    """A file of a new folder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)


def replace_files(target: Path, files: Mapping[str, bytes], stale: tuple[str, ...] = ()) -> None:
    """Files into a folder that may hold others: all are on the disk before the first takes its place, in order.

    stale: names of an earlier run that go away unless written again.
    """
    with staged_path(target) as partial:
        _write_synced_files(partial, files)
        target.mkdir(exist_ok=True)
        for name in stale:
            if name not in files:
                (target / name).unlink(missing_ok=True)
        for name in files:
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            os.replace(partial / name, target / name)
        _sync_folder(target)


def remove_partials(*folders: Path) -> None:
    """Remove what killed runs left behind in folders."""
    for path in [p for folder in folders for p in folder.glob(f"{PARTIAL}*")]:
        _remove(path)


def _write_synced_files(folder: Path, files: Mapping[str, bytes]) -> None:
    folder.mkdir()
    for name, content in files.items():
        write_unsynced(folder / name, content)
    _sync_tree(folder)


def _sync_tree(folder: Path) -> None:
    """Every file and folder in a folder, and itself; several at once, as disks wait for each alone."""
    within = sorted(folder.rglob("*"))
    with ThreadPoolExecutor(SYNC_THREADS) as pool:
        list(pool.map(_sync_file, [path for path in within if not path.is_dir()]))
    for path in [*(path for path in within if path.is_dir()), folder]:
        _sync_folder(path)


def _sync_file(path: Path) -> None:
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def _write_synced(path: Path, content: bytes) -> None:
    with path.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def _sync_folder(path: Path) -> None:
    """Flush a folder's entries, where the system can."""
    with suppress(OSError):
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with suppress(OSError):
            path.unlink()
