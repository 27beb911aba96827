"""Trackers by name: the registered ones, and classes from "path/to/file.py:Class" or "package.module:Class".

`find` returns the tracker class and refuses a class that is no tracker. Worker processes get the string and find the
class themselves.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any, cast

from scenarios.errors import InputError
from scenarios.loading.toml_files import did_you_mean
from sim.types import Tracker
from tracking.config import Config
from tracking.running import used_files
from tracking.user_code import tracker_failed, user_code, what_was_raised

REGISTRY = {
    "blob": "tracking.papers.blob.tracker:Blob",
    "group-pda": "tracking.papers.group_pda.tracker:GroupPda",
    "relational": "tracking.papers.relational.tracker:Relational",
    "particle": "tracking.papers.relational.tracker:Particle",
    "joint": "tracking.papers.joint.tracker:Joint",
    "stereo": "tracking.papers.stereo.tracker:Stereo",
}
NEEDS = ("pixels", "stereo", "boxes", "points", "pixels and boxes")


def names() -> tuple[str, ...]:
    """Returns the names of the registered trackers, in fixed order."""
    return tuple(REGISTRY)


def find(spec: str | type[Tracker]) -> type[Tracker]:
    """Returns the tracker class that `spec` names, a registered name, "file.py:Class" or "module:Class", or that it is.
    Raises InputError if there is none."""
    if not isinstance(spec, str):
        return checked(spec, getattr(spec, "__name__", str(spec)))
    target = REGISTRY.get(spec, spec)
    where, colon, class_name = target.rpartition(":")
    if not colon:
        remedy = did_you_mean(spec, REGISTRY, "choose one.") + " Your own: file.py:Class or package.module:Class"
        raise InputError(place="tracker", got=spec, expected="one of " + ", ".join(REGISTRY), remedy=remedy)
    module = _from_file(Path(where)) if where.endswith(".py") else _from_module(where)
    with user_code(lambda error: _import_failed(where, error)):  # a module may have a __getattr__
        found = getattr(module, class_name, None)
    if found is None:
        raise InputError(file=where, got=repr(class_name), expected="a class of this module", remedy="check the name")
    found = checked(found, spec)
    used_files.require_as_imported(found)
    return found


def _from_file(path: Path) -> Any:
    if not path.is_file():
        raise InputError(file=path, got="no such file", expected="a Python file", remedy="check the path")
    with user_code(lambda error: _import_failed(path, error), passing=()):
        return used_files.load(path)


def _from_module(name: str) -> Any:
    with user_code(lambda error: _import_failed(name, error), passing=()), used_files.inside(used_files.owner_of(name)):
        return importlib.import_module(name)


def _import_failed(where: object, error: BaseException) -> InputError:
    got = what_was_raised(error)
    lacks = isinstance(error, ModuleNotFoundError)
    remedy = "install that module, or put its file beside the tracker's" if lacks else "correct it"
    return InputError(file=where or "tracker", got=got, expected="a module that can be imported", remedy=remedy)


def located(spec: str) -> str:
    """Returns `spec` with an absolute path if it is "file.py:Class", for a process in another folder."""
    where, colon, name = spec.rpartition(":")
    return f"{Path(where).resolve()}:{name}" if colon and where.endswith(".py") else spec


def checked(found: Any, spec: str) -> type[Tracker]:
    """Returns `found` unchanged if it is a tracker class, else raises InputError. spec: the name by which the user gave
    the class, for messages. Raises WorkError if the class's own code fails."""
    with user_code(lambda error: tracker_failed(spec, "class", "before the first frame", error)):
        fault = _class_fault(found)
    if fault:
        expected = f"a class with reset(context, seed), step(frame, detections) and needs, a tuple out of {NEEDS}"
        raise InputError(file=spec, got=fault, expected=expected, remedy="see docs/guides/your-own-tracker.md")
    return found  # type: ignore[no-any-return]


def config_class(tracker: type[Tracker], spec: str) -> type[Config]:
    """Returns the attribute `config_class` of a tracker class. Raises InputError if the class has none. spec: the name
    by which the user gave the tracker, for the message."""
    kind = getattr(tracker, "config_class", None)
    if kind is None:
        remedy = "give the class a config_class that declares them (docs/guides/your-own-tracker.md)"
        raise InputError(place="tracker", got=spec, expected="a tracker with parameters", remedy=remedy)
    return cast("type[Config]", kind)


def _class_fault(found: Any) -> str | None:
    if not isinstance(found, type):
        return f"a {type(found).__name__}"
    missing = [name for name in ("needs", "reset", "step") if not hasattr(found, name)]
    if missing:
        return "no " + ", ".join(missing)
    needs, kind = getattr(found, "needs", ()), getattr(found, "config_class", None)
    if not isinstance(needs, tuple | list) or not needs or not all(need in NEEDS for need in needs):
        return f"needs = {needs!r}"
    if kind is not None and not (isinstance(kind, type) and issubclass(kind, Config)):
        return f"config_class = {kind!r}, which is no tracking.config.Config"
    return None
