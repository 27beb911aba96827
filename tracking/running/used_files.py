"""What decides the answers of a user's tracker, beside this project: its modules, the files it opens, other packages.

`inside(owner)` stands around every call of a tracker's code, and notes which files are opened. `used(tracker)` returns
the fingerprints of all that it has used so far in this process, and `changes` tells which of them are others now.
Names of fingerprints are absolute paths, or "packages" for the versions of all installed packages. A fingerprint is the
hash of a file's content, of the names in a folder that was listed, or "" if there is no such file.

Files that a compiled library opens itself are known if the tracker's code names them in a string.
"""

from __future__ import annotations

import ast
import hashlib
import importlib
import os
import secrets
import sys
import sysconfig
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from importlib.machinery import ModuleSpec
from importlib.util import source_from_cache
from pathlib import Path
from types import ModuleType
from typing import Any

from scenarios.errors import InputError
from sim.hashing import PACKAGES, canonical_hash, file_hash
from sim.types import Tracker
from tracking.running import user_modules
from tracking.running.user_modules import package_of

INSTALLED = "packages"  # name of the fingerprint of all installed packages
OURS = Path(__file__).resolve().parents[2]
NOT_USERS = {"site-packages", "dist-packages", "__pycache__"}  # names of folders
SYSTEM = ("/dev/", "/proc/", "/sys/")
READS = {"open", "os.listdir", "os.scandir", "ctypes.dlopen"}  # audit events of a file or folder that is read
IMPORT = "<frozen importlib._bootstrap_external>"  # file of the code that lists folders in which modules are
THIS_PROCESS = secrets.token_hex(6)

_owner = ""  # whose code is running; "": this project's
_opened: set[str] = set()  # absolute paths that it has opened or listed since it began
_written: set[str] = set()  # that any tracker has written
_files: dict[str, dict[str, str]] = {}  # by owner: fingerprints of what was opened, here and in its other processes
_folders: dict[str, str] = {}  # by owner: its working folder, if it has changed it
_times = 0  # how many times files were opened, and noted


@dataclass(frozen=True)
class _Module:
    spec: ModuleSpec | None  # another one after a reload
    path: str
    hash: str
    named: frozenset[str]  # paths of the files that strings in its code name


_modules: dict[str, _Module] = {}  # modules of users as they were at first sight
_latest: dict[Path, tuple[str, str]] = {}  # names of the package, and of the module, of each tracker's file


def owner_of(module: str) -> str:
    """Returns whose code a module is, by its name: its package, or "" for this project."""
    head = module.partition(".")[0]
    return package_of(module) if head in PACKAGES else head


def load(file: Path) -> ModuleType:
    """Returns the module of a tracker's file. It is loaded anew if it, or a file that it imported, has changed."""
    file = file.resolve()
    package, module = _latest.get(file, ("", ""))
    if not package or changes(user_modules.packages[package].files):
        package, module = user_modules.new_package(file)
        with inside(package):
            importlib.import_module(module)
        own = user_modules.packages[package]
        own.code = canonical_hash(relative(own.files, own.folder))[:12]
        _latest[file] = package, module
    return sys.modules[module]


@contextmanager
def inside(owner: str) -> Iterator[None]:
    """Stands around code of this owner: notes the files that it opens, and keeps its working folder apart from that of
    the command. It has no effect for "", this project's code, and inside another such block."""
    global _owner, _times
    if not owner or _owner:
        yield
        return
    _listen()
    _owner, home = owner, _working_folder()
    try:
        if owner in _folders:
            os.chdir(_folders[owner])
        yield
    finally:
        _owner = ""
        if _working_folder() != home:
            _folders[owner] = _working_folder()
            os.chdir(home)
        user_modules.forget_aliases()
        if _opened:
            _times += 1
            _files.setdefault(owner, {}).update({path: fingerprint(path) for path in _opened})
            _opened.clear()


@cache
def _listen() -> None:
    sys.addaudithook(_hook)  # once, as a hook cannot be removed


def _working_folder() -> str:
    with suppress(FileNotFoundError):
        return os.getcwd()
    return os.sep


def _hook(event: str, arguments: tuple[Any, ...]) -> None:
    if not _owner or event not in READS:
        return
    with suppress(Exception):  # an exception here would be one of open()
        path = os.path.abspath(os.fsdecode(arguments[0] or "."))
        if path.endswith(".pyc"):
            path = source_from_cache(path)
        if event == "open" and arguments[2] & (os.O_WRONLY | os.O_CREAT | os.O_TRUNC):
            _written.add(path)
        elif event != "os.listdir" or sys._getframe(1).f_code.co_filename != IMPORT:
            _opened.add(path)


def fingerprint(path: str) -> str:
    """Returns the fingerprint of the file or folder at an absolute path as it is now."""
    try:
        if not os.path.isdir(path):
            return file_hash(Path(path))
        names = sorted({*os.listdir(path)} - NOT_USERS)
        return hashlib.sha256("\0".join(names).encode()).hexdigest()
    except OSError:
        return ""


@cache
def is_users(path: str) -> bool:
    """Returns True if a file belongs neither to this project, nor to Python, an installed package or the system."""
    path = os.path.realpath(path)
    return not (path.startswith((*SYSTEM, *_places())) or NOT_USERS & {*Path(path).parts})


@cache
def _places() -> tuple[str, ...]:
    names = ("stdlib", "platstdlib")
    ours = [str(OURS / name) for name in PACKAGES]
    return tuple(f"{os.path.realpath(place)}{os.sep}" for place in (*ours, *map(sysconfig.get_path, names)))


def used(tracker: type[Tracker]) -> dict[str, str]:
    """Returns the fingerprints of all that a tracker class has used in this process so far, by name; {} for a tracker
    of this project."""
    owner = owner_of(tracker.__module__)
    if not owner:
        return {}
    found = dict(_modules_used(owner))
    if owner in user_modules.packages:
        found |= user_modules.packages[owner].files
    found |= {p: known for p, known in _files.get(owner, {}).items() if p not in _written and is_users(p)}
    return found | {INSTALLED: packages_hash()}


def opened() -> int:
    """Returns how many times files have been opened by trackers in this process, and noted."""
    return _times


def note(tracker: type[Tracker], others: Mapping[str, str]) -> None:
    """Notes what a tracker class has used in another process, as `used` returned it there."""
    _files.setdefault(owner_of(tracker.__module__), {}).update(others)


def changes(stored: Mapping[str, str], folder: str = "") -> list[str]:
    """Returns the names of fingerprints that differ from the present ones. folder: to which names are relative."""
    return [name for name, known in stored.items() if known != _now(name, folder)]


def _now(name: str, folder: str) -> str:
    return packages_hash() if name == INSTALLED else fingerprint(os.path.join(folder, name))


def relative(found: Mapping[str, str], folder: str) -> dict[str, str]:
    """Returns fingerprints with the names of files below the folder relative to it."""
    below = os.path.join(folder, "")
    return {name.removeprefix(below): known for name, known in found.items()}


def folder_of(tracker: type[Tracker]) -> str:
    """Returns the folder of the file that defines a tracker class, "" if there is none."""
    file = getattr(sys.modules.get(tracker.__module__), "__file__", None)
    return os.path.dirname(os.path.abspath(file)) if file else ""


def _modules_used(owner: str) -> Iterator[tuple[str, str]]:
    """Yields path and fingerprint of the modules of users, and of the files that strings in their code name."""
    for name in [*sys.modules]:
        known = _module(name) if package_of(name) in ("", owner) else None
        if known is not None and (name != "__main__" or owner == "__main__"):
            yield known.path, known.hash
            yield from ((path, fingerprint(path)) for path in known.named - _written)


def _module(name: str) -> _Module | None:
    """Returns a module of a user, None for another module."""
    module = sys.modules.get(name)
    file = getattr(module, "__dict__", {}).get("__file__")
    if not isinstance(file, str) or not is_users(file):
        return None
    spec = getattr(module, "__spec__", None)
    if name not in _modules or _modules[name].spec is not spec:
        path, named = os.path.abspath(file), set[str]()
        with suppress(Exception):  # a compiled module has no code
            named = {*_named(ast.parse(Path(path).read_bytes()), os.path.dirname(path))}
        _modules[name] = _Module(spec, path, fingerprint(path), frozenset(named))
    return _modules[name]


def _named(code: ast.Module, folder: str) -> Iterator[str]:
    """Yields the paths of files that strings in the code name: in the working folder, in this folder, or below it in
    one that another string names."""
    words = {node.value for node in ast.walk(code) if isinstance(node, ast.Constant) and isinstance(node.value, str)}
    words |= {word.lstrip(os.sep) for word in words}  # of f"{folder}/name"
    for place in (_working_folder(), folder, *(os.path.join(folder, word) for word in words if "." not in word)):
        if os.path.isdir(place):
            paths = (os.path.abspath(os.path.join(place, word)) for word in words if "." in word)
            yield from (path for path in paths if os.path.isfile(path) and is_users(path))


@cache
def packages_hash() -> str:
    """Returns the hash of names and versions of all installed packages."""
    names = sorted(found.name for folder in sys.path for found in Path(folder).glob("*.dist-info"))
    return hashlib.sha256("\0".join(names).encode()).hexdigest()


def code_of(tracker: type[Tracker]) -> str:
    """Returns 12 hex digits that name the code of a tracker class and its base classes as it was imported, "" for a
    tracker of this project. It is the same in every process, except for a class without a file, whose code is unknown.
    """
    owner = owner_of(tracker.__module__)
    if not owner:
        return ""
    if owner in user_modules.packages:
        return user_modules.packages[owner].code
    files = {name: _module(name) for name in dict.fromkeys(kind.__module__ for kind in tracker.__mro__)}
    own = {name: known.hash for name, known in files.items() if known is not None}
    return canonical_hash(own)[:12] if tracker.__module__ in own else THIS_PROCESS


def require_as_imported(tracker: type[Tracker]) -> None:
    """Raises InputError if a module that a tracker class comes from, or imports, has changed since its import. The
    modules beside a tracker's file are not looked at: they are loaded anew."""
    owner = owner_of(tracker.__module__)
    heads = {kind.__module__.partition(".")[0] for kind in tracker.__mro__}
    if owner in user_modules.packages:
        heads |= user_modules.packages[owner].installed
    for name in [name for name in sys.modules if owner and name.partition(".")[0] in heads]:
        known = None if package_of(name) else _module(name)
        if known is not None and fingerprint(known.path) != known.hash:
            raise InputError(
                file=known.path, got=f"another content than when {name} was imported", expected="the code that runs",
                remedy="start Python anew",
            )  # fmt: skip


class UsedFiles(dict[str, str]):
    """What a tracker has used in one command, from all processes: fingerprints by name."""

    def add(self, tracker: str, more: Mapping[str, str]) -> None:
        """Adds fingerprints. Warns of those that differ from an earlier episode, and keeps the first."""
        for name, known in more.items():
            if self.setdefault(name, known) != known:
                text = f"{name} has changed while the command ran: run it again, stress and tune with --fresh"
                warnings.warn(f"{tracker}: {text}", UserWarning, stacklevel=2)
