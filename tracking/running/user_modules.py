"""Loads the file of a user's tracker with the modules beside it; each tracker's file has modules of its own.

The file and its neighbours form a package below this module, whose name holds the folder. So every process that imports
`tracking` can import it, as the processes of a pool do. Import statements look for a neighbour first, as in a script,
then for an installed module. A name that a neighbour lacks is taken from the installed module of the same name. So a
neighbour `queue.py`, `sim.py` or `tracking.py` hides no module from other code, folders may have modules of equal
names, and files that have changed are loaded anew.
"""

from __future__ import annotations

import builtins
import importlib
import importlib.util
import os
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from importlib.abc import Loader
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader, FileFinder, ModuleSpec, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

from sim.hashing import PACKAGES, file_hash

__path__: list[str] = []  # so that this module can have submodules
PREFIX = f"{__name__}."
PRIVATE = re.compile(re.escape(PREFIX) + r"[0-9a-f]+x*\.")  # what stands before a neighbour's own name
DOT = "\u2024"  # stands for a dot in the name of a file, as in tracker.v2.py


@dataclass
class UserPackage:
    """The package of one tracker's file.

    State: the hash of each file as it was executed, the names of the installed modules that it imports, and `code`, a
    hash of the files that the tracker's file imports at once.
    """

    folder: str
    code: str = ""
    files: dict[str, str] = field(default_factory=dict)
    installed: set[str] = field(default_factory=set)


packages: dict[str, UserPackage] = {}  # by private name
aliases: set[str] = set()  # public names under which neighbours are found while a tracker's code runs


def package_of(module: str) -> str:
    """Returns the name of the private package that a module belongs to, by the module's name; "" if to none."""
    return PREFIX + module.removeprefix(PREFIX).partition(".")[0] if module.startswith(PREFIX) else ""


def new_package(file: Path) -> tuple[str, str]:
    """Returns the names of a new package, and of its module for a tracker's file at an absolute path. They are the same
    in every process, for pickles and numba's cache, and the package's is the same for all files of a folder."""
    name = PREFIX + os.fsencode(file.parent).hex()
    while name in packages:
        name += "x"
    return name, f"{name}.{file.stem.replace('.', DOT)}"


class _Loader(SourceFileLoader):
    # Compiles the source itself: a stored .pyc is taken for the source's if both are of one second and size.

    def get_code(self, fullname: str) -> CodeType:
        content = self.get_data(self.path)
        packages[package_of(fullname)].files[self.path] = file_hash(content)
        return self.source_to_code(content, self.path)

    def exec_module(self, module: ModuleType) -> None:
        package = package_of(module.__name__)
        name = module.__name__.removeprefix(f"{package}.")
        module.__dict__["__builtins__"] = {**vars(builtins), "__import__": partial(_import, package)}
        if _installed(name, packages[package].folder):
            module.__dict__["__getattr__"] = partial(_of_installed, name, self.path)
        super().exec_module(module)


LOADERS = (ExtensionFileLoader, EXTENSION_SUFFIXES), (_Loader, [".py"])


class _Finder:
    # Finds the modules of private packages only.

    @staticmethod
    def find_spec(name: str, path: Sequence[str] | None = None, target: object = None) -> ModuleSpec | None:
        package = package_of(name)
        if package and package == name:
            folder = os.fsdecode(bytes.fromhex(name.removeprefix(PREFIX).rstrip("x")))
            if packages and not os.path.isdir(folder):  # numba's cache was written before the folder was moved
                folder = packages[next(reversed(packages))].folder
            packages[name] = UserPackage(folder)
            spec = ModuleSpec(name, None, is_package=True)
            spec.submodule_search_locations = [folder]
            return spec
        if DOT in name and package:
            file = Path(packages[package].folder, name.rpartition(".")[2].replace(DOT, ".") + ".py")
            return importlib.util.spec_from_file_location(name, file, loader=_Loader(name, str(file)))
        found = (FileFinder(folder, *LOADERS).find_spec(name) for folder in (path or () if package else ()))
        return next(filter(None, found), None)


class _Neighbours:
    # Finds neighbours for importlib.import_module and pickle, which no import statement calls, after installed modules.

    @staticmethod
    def find_spec(name: str, path: Sequence[str] | None = None, target: object = None) -> ModuleSpec | None:
        frame = sys._getframe()
        while frame.f_back is not None and not package_of(frame.f_globals.get("__name__", "")):
            frame = frame.f_back
        package = package_of(frame.f_globals.get("__name__", ""))
        if package not in packages or _Finder.find_spec(f"{package}.{name}", [packages[package].folder]) is None:
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


sys.meta_path.insert(0, _Finder)
sys.meta_path.append(_Neighbours)


def forget_aliases() -> None:
    """Removes the public names of neighbours, which other folders may have, too."""
    for name in aliases:
        sys.modules.pop(name, None)
    aliases.clear()


@cache
def _places(package: str, head: str) -> tuple[str, ...]:
    """Returns the prefixes under which a name is looked for, in order: the package's and "", or one of them."""
    folder = packages[package].folder
    neighbour = _Finder.find_spec(f"{package}.{head}", [folder])
    sources_of_ours = head in PACKAGES and all(Path(folder, name, "__init__.py").is_file() for name in PACKAGES)
    if neighbour is None or sources_of_ours:
        return ("",)
    if not _installed(head, folder):
        return (f"{package}.",)
    return (f"{package}.", "") if neighbour.loader is not None else ("", f"{package}.")


def _installed(name: str, folder: str) -> bool:
    """Returns True if there is a module of this name outside of the folder."""
    try:
        spec = importlib.util.find_spec(name) if name and "." not in name else None
    except (ImportError, ValueError):  # it has no spec, such as __main__
        return False
    own = {os.path.join(folder, place) for place in (name, f"{name}.py", f"{name}/__init__.py")}
    if spec is None or isinstance(spec.loader, _Alias):
        return False
    return own.isdisjoint({spec.origin, *(spec.submodule_search_locations or ())})


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
