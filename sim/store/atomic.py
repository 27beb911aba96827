"""Safe writing: a file or folder appears complete or not at all, and two commands never write to one folder at a time.

What is written gets a temporary name, then the name of its target. An OSError becomes a WorkError if the disk is full,
else an InputError. Killed runs leave files with names .partial-…-<12 hex digits>, which `remove_partials` deletes. A
power failure may damage files; their hashes in the seals tell. A lock on an output folder makes a second command fail
at once. On Windows and on file systems without such locks, nothing is locked.
"""

from __future__ import annotations

import errno
import os
import re
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from uuid import uuid4

from scenarios.errors import FlockscopeError, InputError, WorkError

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

# folders whose lock an enclosing block of this thread holds
_held: ContextVar[frozenset[Path]] = ContextVar("held", default=frozenset())


@contextmanager
def lock_folder(root: Path, held: bool = False) -> Iterator[None]:
    """Creates the folder `root` and locks it while the block runs.

    Raises InputError at once if another command or thread holds the lock. held: True allows the block to stand inside
    another block of the same thread for the same folder; the inner block then changes nothing.
    """
    if held and root.resolve() in _held.get():
        yield
        return
    made = _absent(root)
    try:
        descriptor = _locked(root)
        token = _held.set(_held.get() | {root.resolve()})
        try:
            yield
        finally:
            _held.reset(token)
            _remove_empty(made)  # only who holds the lock may remove what others would lock
            os.close(descriptor)
    except OSError as error:
        raise write_error(root, error) from error


def _locked(root: Path) -> int:
    while True:
        root.mkdir(parents=True, exist_ok=True)
        if fcntl is None:
            return os.open(os.devnull, os.O_RDONLY)
        with suppress(FileNotFoundError):  # removed by who held its lock
            descriptor = os.open(root, os.O_RDONLY)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                os.close(descriptor)
                got, remedy = "another run that writes here", "wait, or choose another --out"
                raise InputError(file=root, got=got, expected="one at a time", remedy=remedy) from None
            except OSError:  # NFS cannot lock folders
                return descriptor
            # Another folder may stand at the path now, or none.
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(descriptor), os.stat(root)):
                    return descriptor
            os.close(descriptor)


def _absent(folder: Path) -> list[Path]:
    return [p for p in (folder, *folder.parents) if not p.exists()]


def _remove_empty(folders: list[Path]) -> None:
    with suppress(OSError):
        for folder in folders:
            folder.rmdir()


PARTIAL = ".partial-"  # beginning of temporary names
# all of a temporary name: with the name of the target, or the marker of a cluster's run
OURS = re.compile(re.escape(PARTIAL) + r"(?:(.*)-[0-9a-f]{12}|[0-9a-f]{32})", re.DOTALL)
DISK_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


# A full disk is no fault of the call, so it is a WorkError (exit 1) and not an InputError (exit 2).
def write_error(path: Path, error: OSError) -> FlockscopeError:
    """Returns the error to show for an OSError while writing `path`: WorkError if the disk is full, else InputError."""
    reason = error.strerror or type(error).__name__
    if error.errno in DISK_FULL:
        remedy = "free some; what was complete is kept"
        return WorkError(file=path, got=reason, expected="room on the disk", remedy=remedy)
    return InputError(file=path, got=reason, expected="a folder that can be written", remedy="choose another --out")


@contextmanager
def staged_path(target: Path) -> Iterator[Path]:
    """Yields a temporary path beside the target for the block to write to and rename; else it is deleted at the end."""
    # Two machines that share a disk may have the same process id, so the name is random.
    partial = target.parent / f"{PARTIAL}{target.name}-{uuid4().hex[:12]}"
    made = _absent(target.parent)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        yield partial
    except OSError as error:
        raise write_error(target, error) from error
    finally:
        _remove(partial)
        _remove_empty(made)


def write_file(target: Path, content: bytes) -> None:
    """Writes `content` to the file `target`, which appears complete or not at all; an existing file is replaced."""
    with new_file(target) as partial:
        partial.write_bytes(content)


@contextmanager
def new_file(target: Path) -> Iterator[Path]:
    """Yields a temporary path for the block to write a file to; the file replaces the target when the block ends."""
    with staged_path(target) as partial:
        yield partial
        os.replace(partial, target)


@contextmanager
def new_folder(target: Path, keep: Callable[[], bool]) -> Iterator[Path]:
    """Yields a temporary folder that becomes `target` when the block ends.

    If `target` exists then, `keep()` decides: True keeps it and drops the new folder, False replaces it.
    """
    with staged_path(target) as partial:
        partial.mkdir()
        yield partial
        if target.exists():
            # Two writers may make the same sequence: the first one wins. `keep` raises for a folder that must stay.
            if keep():
                return
            _remove(target)
        try:
            os.rename(partial, target)
        except OSError:
            if not (target.exists() and keep()):
                raise


def write_inside(path: Path, content: bytes) -> None:
    """Writes a file directly, without a temporary name, and makes missing folders above it; for temporary folders."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)


def replace_sealed(target: Path, files: Mapping[str, bytes], seal: str, names: Iterable[str] = ()) -> None:
    """Writes `files` (content by name) into the folder `target`, and deletes the files `names` that are not in `files`.

    seal: name of the one of `files` that marks a complete folder. It is deleted first and written last, so a killed run
    leaves either all old files, or a folder without a seal.
    """
    # The first file appears first, so that it marks even a folder that never had a seal.
    first, *others = (name for name in files if name != seal)
    remove_partials(target.parent, of=target.name)
    with staged_path(target) as partial:
        for name, content in files.items():
            write_inside(partial / name, content)
        target.mkdir(exist_ok=True)
        (target / seal).unlink(missing_ok=True)
        os.replace(partial / first, target / first)
        for name in names:
            if name not in files:
                (target / name).unlink(missing_ok=True)
        for name in (*others, seal):
            os.replace(partial / name, target / name)


def remove_partials(*folders: Path, of: str = "") -> None:
    """Deletes the files and folders with temporary names in `folders`. of: only those for a target of this name."""
    for path in [p for folder in folders for p in folder.glob(f"{PARTIAL}*")]:
        found = OURS.fullmatch(path.name)
        if found and of in ("", found[1]):
            _remove(path)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with suppress(OSError):
            path.unlink()
