"""Loads the file of a user's tracker with the modules beside it; each tracker's file has modules of its own.

The file and its neighbours form a package with a private name. Their import statements look for a neighbour first, as
in a script, then for an installed module. A name that a neighbour lacks is taken from the installed module of the same
name. So a neighbour `queue.py`, `sim.py` or `tracking.py` hides no module from other code, folders may have modules of
equal names, and files that have changed are loaded anew.
"""

from __future__ import annotations

import builtins
import hashlib
import importlib
import importlib.util
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import cache, partial
from importlib.abc import Loader
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader, ModuleSpec, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

from sim.hashing import PACKAGES, canonical_hash, file_hash

PREFIX = "_flockscope_"


@dataclass
class UserPackage:
    """The package of one tracker's file.

    State: the hash of each file as it was executed, the strings in its code, the names of the installed modules that it
    imports, and `code`, a hash of the files that the tracker's file imports at once.
    """

    folder: Path
    code: str = ""
    files: dict[Path, str] = field(default_factory=dict)
    words: dict[Path, frozenset[str]] = field(default_factory=dict)
    installed: set[str] = field(default_factory=set)


packages: dict[str, UserPackage] = {}  # by private name
aliases: set[str] = set()  # public names under which neighbours are found while a tracker's code runs
_latest: dict[Path, str] = {}  # name of the package of each tracker's file


def load(file: Path, inside: Callable[[str], AbstractContextManager[None]]) -> ModuleType:
    """Returns the module of a tracker's file. It is loaded anew if it, or a file that it imported, has changed. inside:
    given the name of the private package, returns a context manager in which the file is executed."""
    file = file.resolve()
    name = _latest.get(file, "")
    if not name or any(_hash_now(path) != known for path, known in packages[name].files.items()):
        name = _load_package(file, inside)
        _latest[file] = name
    return sys.modules[f"{name}.{_stem(file)}"]


def _load_package(file: Path, inside: Callable[[str], AbstractContextManager[None]]) -> str:
    if _Finder not in sys.meta_path:
        sys.meta_path.insert(0, _Finder)
        sys.meta_path.append(_Neighbours)
    # The same name in every process, for pickles and numba's cache; of a folder, as its files share their caches.
    name = PREFIX + hashlib.sha256(str(file.parent).encode()).hexdigest()[:12]
    while name in packages:
        name += "x"
    packages[name] = UserPackage(file.parent)
    package = ModuleType(name)
    package.__path__ = [str(file.parent)]
    sys.modules[name] = package
    try:
        spec = _spec(f"{name}.{_stem(file)}", file)
        module = importlib.util.module_from_spec(spec)
        sys.modules[spec.name] = module
        assert spec.loader is not None
        with inside(name):
            spec.loader.exec_module(module)
    except BaseException:
        _places.cache_clear()  # a missing neighbour may be put there
        for loaded in [one for one in sys.modules if one.partition(".")[0] == name]:
            del sys.modules[loaded]
        del packages[name]
        raise
    own = packages[name]
    own.code = canonical_hash({os.path.relpath(path, own.folder): known for path, known in own.files.items()})[:12]
    return name


def _stem(file: Path) -> str:
    return file.stem.replace(".", "_")


def _hash_now(path: Path) -> str:
    return file_hash(path.read_bytes()) if path.is_file() else ""


class _Loader(SourceFileLoader):
    # Compiles the source itself: a stored .pyc is taken for the source's if both are of one second and size.

    def get_code(self, fullname: str) -> CodeType:
        content, path = self.get_data(self.path), Path(self.path)
        code: CodeType = self.source_to_code(content, self.path)
        package = packages[fullname.partition(".")[0]]
        package.files[path], package.words[path] = file_hash(content), frozenset(strings_of(code))
        return code

    def exec_module(self, module: ModuleType) -> None:
        package, _, name = module.__name__.partition(".")
        own_import = partial(_import, package)
        module.__dict__["__builtins__"] = {**vars(builtins), "__import__": own_import}
        if _installed(name, packages[package].folder):
            module.__dict__["__getattr__"] = partial(_of_installed, name, self.path)
        super().exec_module(module)


def strings_of(code: CodeType) -> Iterator[str]:
    """Yields all strings in the code of a module and of its functions."""
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from strings_of(constant)
        elif isinstance(constant, str):
            yield constant


def _spec(name: str, file: Path, places: list[str] | None = None) -> ModuleSpec:
    loader = (ExtensionFileLoader if file.suffix != ".py" else _Loader)(name, str(file))
    spec = importlib.util.spec_from_file_location(name, file, loader=loader, submodule_search_locations=places)
    assert spec is not None
    return spec


class _Finder:
    # Finds the modules of private packages only.

    @classmethod
    def find_spec(cls, name: str, path: Sequence[str] | None = None, target: object = None) -> ModuleSpec | None:
        tail = name.rpartition(".")[2]
        if name.startswith(PREFIX) and path is None and packages:  # of another process, or before the folder was moved
            folder = packages[next(reversed(packages))].folder
            packages[name] = UserPackage(folder)
            return _folder_spec(name, folder)
        for folder in map(Path, path or () if name.startswith(PREFIX) else ()):
            for suffix in (".py", *EXTENSION_SUFFIXES):
                package, module = folder / tail / f"__init__{suffix}", folder / f"{tail}{suffix}"
                if package.is_file():
                    return _spec(name, package, [str(folder / tail)])
                if module.is_file():
                    return _spec(name, module)
            if (folder / tail).is_dir():
                return _folder_spec(name, folder / tail)
        return None


def _folder_spec(name: str, folder: Path) -> ModuleSpec:
    spec = ModuleSpec(name, None, is_package=True)
    spec.submodule_search_locations = [str(folder)]
    return spec


class _Neighbours:
    # Finds neighbours for importlib.import_module and pickle, which no import statement calls, after installed modules.

    @classmethod
    def find_spec(cls, name: str, path: Sequence[str] | None = None, target: object = None) -> ModuleSpec | None:
        frame = sys._getframe()
        while frame.f_back is not None and not frame.f_globals.get("__name__", "").startswith(PREFIX):
            frame = frame.f_back
        package = frame.f_globals.get("__name__", "").partition(".")[0]
        if package not in packages or _Finder.find_spec(f"{package}.{name}", [str(packages[package].folder)]) is None:
            return None
        aliases.add(name)
        return ModuleSpec(name, _Alias(f"{package}.{name}"))


class _Alias(Loader):
    def __init__(self, name: str) -> None:
        self.name = name

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        return importlib.import_module(self.name)

    def exec_module(self, module: ModuleType) -> None:
        pass


def forget_aliases() -> None:
    """Removes the public names of neighbours, which other folders may have, too."""
    for name in aliases:
        sys.modules.pop(name, None)
    aliases.clear()


@cache
def _places(package: str, head: str) -> tuple[str, ...]:
    """Returns the prefixes under which a name is looked for, in order: the package's and "", or one of them."""
    folder = packages[package].folder
    neighbour = _Finder.find_spec(f"{package}.{head}", [str(folder)])
    sources_of_ours = head in PACKAGES and all((folder / name / "__init__.py").is_file() for name in PACKAGES)
    if neighbour is None or sources_of_ours:
        return ("",)
    if not _installed(head, folder):
        return (f"{package}.",)
    return (f"{package}.", "") if neighbour.loader is not None else ("", f"{package}.")


def _installed(name: str, folder: Path) -> bool:
    """Returns True if there is a module of this name outside of the folder."""
    try:
        spec = importlib.util.find_spec(name) if name and "." not in name else None
    except (ImportError, ValueError):  # it has no spec, such as __main__
        return False
    own = {str(folder / name), str(folder / f"{name}.py"), str(folder / name / "__init__.py")}
    return spec is not None and own.isdisjoint({spec.origin, *(spec.submodule_search_locations or ())})


def _import(
    package: str, name: str, globals: Any = None, locals: Any = None, fromlist: Any = (), level: int = 0
) -> Any:
    head, standard = name.partition(".")[0], builtins.__import__
    places = ("",) if level else _places(package, head)
    if places == ("",):
        packages[package].installed.add(head)
        return standard(name, globals, locals, fromlist, level)
    for place in places:
        try:
            found = standard(place + name, globals, locals, fromlist or ("__name__",), 0)
        except ModuleNotFoundError as error:
            if place == places[-1] or not f"{place}{name}.".startswith(f"{error.name}."):
                raise
            continue
        if not fromlist:  # `import a.b` gives a
            return sys.modules[(places[0] or place) + head]
        missing = [one for one in fromlist if one != "*" and not hasattr(found, one)]
        if missing and isinstance(vars(found).get("__getattr__"), partial):
            _of_installed(head, str(found.__file__), missing[0], error=ImportError)
        return found
    raise AssertionError(name)


def _of_installed(module: str, file: str, name: str, error: type[Exception] = AttributeError) -> Any:
    # Dunder names are those of the neighbour: the import system asks for some.
    if name.startswith("__"):
        raise AttributeError(name)
    found = importlib.import_module(module)
    if not hasattr(found, name):
        there = getattr(found, "__file__", None) or f"the module {module} of Python"
        raise error(f"neither {file} nor {there} has {name!r}: rename {Path(file).name}, which hides the other")
    return getattr(found, name)
