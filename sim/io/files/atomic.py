"""Atomic writing: a file or folder is written under a temporary name, synced to disk, then renamed to its target.

It therefore appears complete or not at all. An OSError becomes a WorkError if the disk is full, else an InputError.
Killed runs leave files with names .partial-…-<12 hex digits>, which `remove_partials` deletes.
"""

from __future__ import annotations

import errno
import os
import re
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from uuid import uuid4

from scenarios.errors import FlockscopeError, InputError, WorkError

PARTIAL = ".partial-"  # beginning of temporary names
OURS = re.compile(re.escape(PARTIAL) + r"(.*-[0-9a-f]{12}|[0-9a-f]{32})", re.DOTALL)  # all of a temporary name
SYNC_THREADS = 8  # files synced at a time
DISK_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def write_error(path: Path, error: OSError) -> FlockscopeError:
    """Return (not raise) the user's error for an OSError while writing `path`.

    It is a WorkError if the disk or quota is full or the file too large, else an InputError.
    """
    reason = error.strerror or type(error).__name__
    if error.errno in DISK_FULL:
        return WorkError(
            file=path, got=reason, expected="room on the disk", remedy="free some; what was complete is kept"
        )
    return InputError(file=path, got=reason, expected="a folder that can be written", remedy="choose another --out")


@contextmanager
def staged_path(target: Path) -> Iterator[Path]:
    """Give a temporary path beside the target for the length of the block, then delete what is left there.

    The block creates a file or folder at that path and renames it to the target. The target's missing parents are
    created, and removed again if they stay empty. The name is random, since writers on two machines may share a process
    id. An OSError inside the block, or on creating the parents, is raised as WorkError if the disk is full, else as
    InputError (write_error).
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
    """Write `content` to the file `target`, which appears complete or not at all; an existing file is replaced.

    Missing parent folders are created. Raises WorkError if the disk is full, InputError if the file cannot be written.
    """
    with staged_path(target) as partial:
        partial.write_bytes(content)
        move_synced(partial, target)


@contextmanager
def new_file(target: Path) -> Iterator[Path]:
    """Give a temporary path for the block to write a file to; the file replaces the target when the block ends.

    If the block ends with an exception, the temporary file is deleted and the target stays as it was. Missing parent
    folders are created. An OSError is raised as WorkError if the disk is full, else as InputError; so is a block that
    has created no file.
    """
    with staged_path(target) as partial:
        yield partial
        move_synced(partial, target)


def move_synced(partial: Path, target: Path) -> None:
    """Rename the file `partial` to `target`, in the same folder, after its content has reached the disk.

    Some file systems report only then that the disk is full. An existing target is replaced. Raises OSError.
    """
    _sync_file(partial)
    os.replace(partial, target)
    _sync_folder(target.parent)


@contextmanager
def new_folder(target: Path, keep: Callable[[], bool]) -> Iterator[Path]:
    """Give an empty temporary folder for the block to fill; it becomes the folder `target` when the block ends.

    An existing target is deleted first, unless `keep()` returns True: then the target stays and the new folder is
    dropped. `keep` serves two writers of the same sequence, of which the first one wins; and it raises for a target
    that must not be deleted. If the block ends with an exception, the new folder is deleted and the target stays. An
    OSError is raised as WorkError if the disk is full, else as InputError.
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


def write_unsynced(path: Path, content: bytes) -> None:
    """Write a file into a folder that is still temporary, without syncing it to disk; missing parents are created.

    An existing file is overwritten. Raises OSError if the file cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)


def replace_sealed(target: Path, files: Mapping[str, bytes], seal: str, names: Iterable[str] = ()) -> None:
    """Write files into the folder `target`, which may hold files of others; they count as complete once `seal` is
    there.

    files: content by name; all are synced to disk before the first replaces its target. seal: the last of their names.
    The old seal is deleted before any other file changes, and the new one appears after all others have. A killed run
    therefore leaves the old files whole or a folder without a seal. The first of `files` is the first to appear, so
    that it marks even a folder that never had a seal. names: files that are deleted unless `files` has them. Other
    files stay. A missing folder is created, and what killed runs left for this target is deleted.

    Raises WorkError if the disk is full, InputError if the folder cannot be written.
    """
    first, *others = (name for name in files if name != seal)
    for path in _leftovers(target):
        _remove(path)
    with staged_path(target) as partial:
        _write_synced_files(partial, files)
        target.mkdir(exist_ok=True)
        (target / seal).unlink(missing_ok=True)
        _sync_folder(target)
        os.replace(partial / first, target / first)
        _sync_folder(target)
        for name in names:
            if name not in files:
                (target / name).unlink(missing_ok=True)
        for name in others:
            os.replace(partial / name, target / name)
        _sync_folder(target)
        os.replace(partial / seal, target / seal)
        _sync_folder(target)


def _leftovers(target: Path) -> list[Path]:
    """Return the temporary files and folders that killed writers of `target`, and of no other, left beside it."""
    if not target.parent.is_dir():
        return []
    form = re.compile(re.escape(f"{PARTIAL}{target.name}-") + "[0-9a-f]{12}")
    return [path for path in target.parent.iterdir() if form.fullmatch(path.name)]


def remove_partials(*folders: Path) -> None:
    """Delete the temporary files and folders directly in the given folders, left by killed runs.

    Their names are .partial-<name>-<12 hex digits>, or .partial-<32 hex digits> for a marker of `generate`; files with
    other names stay. Missing folders, and files that cannot be deleted, are ignored.
    """
    for path in [p for folder in folders for p in folder.glob(f"{PARTIAL}*") if OURS.fullmatch(p.name)]:
        _remove(path)


def _write_synced_files(folder: Path, files: Mapping[str, bytes]) -> None:
    folder.mkdir()
    for name, content in files.items():
        write_unsynced(folder / name, content)
    _sync_tree(folder)


def _sync_tree(folder: Path) -> None:
    """Sync a folder and all files and folders below it to disk; files in 8 threads, which is faster than one by one.

    Raises OSError if a file cannot be synced; folders that cannot be synced are ignored.
    """
    within = sorted(folder.rglob("*"))
    with ThreadPoolExecutor(SYNC_THREADS) as pool:
        list(pool.map(_sync_file, [path for path in within if not path.is_dir()]))
    for path in [*(path for path in within if path.is_dir()), folder]:
        _sync_folder(path)


def _sync_file(path: Path) -> None:
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def _sync_folder(path: Path) -> None:
    """Sync the list of entries of the folder `path` to disk; does nothing on systems that cannot. Raises nothing."""
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
