"""Trackers by name, by file or by module; what they need against what a source has; what they may return.

A tracker is given as a registered name ("blob"), as "path/to/file.py:Class" or as "package.module:Class". Workers get
the string, never a pickle.
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import inspect
import sys
from functools import cache
from pathlib import Path
from typing import Any, cast

import numpy as np

from scenarios.errors import InputError
from scenarios.loading.toml_files import closest
from sim.types import DetectionMode, Detections, Sequence, Tracker
from tracking.answers import History, check_tracks, finite
from tracking.config import Config

__all__ = [
    "History", "check_detections", "check_tracks", "checked", "choose_mode", "code", "config_class", "find", "names",
    "own_detector",
]  # fmt: skip

REGISTRY = {"blob": "tracking.papers.blob.tracker:Blob", "group-pda": "tracking.papers.group_pda.tracker:GroupPda"}
NEEDS = ("pixels", "stereo", "boxes", "points")


def names() -> tuple[str, ...]:
    """The registered trackers."""
    return tuple(REGISTRY)


def find(spec: str) -> type[Tracker]:
    """The tracker class that `spec` names; InputError when there is none, or when it is no tracker."""
    target = REGISTRY.get(spec, spec)
    where, colon, class_name = target.rpartition(":")
    if not colon:
        remedy = f"did you mean {closest(spec, REGISTRY)}? Your own: file.py:Class or package.module:Class"
        raise InputError(place="tracker", got=spec, expected="one of " + ", ".join(REGISTRY), remedy=remedy)
    module = _from_file(Path(where)) if where.endswith(".py") else _from_module(where)
    found = getattr(module, class_name, None)
    if found is None:
        raise InputError(file=where, got=repr(class_name), expected="a class of this module", remedy="check the name")
    return checked(found, spec)


def _from_file(path: Path) -> Any:
    """Load a file under a private name, so that it shadows nothing and two of the same stem can live together.

    Loaded once as long as it is what it was: its classes stay the same ones, so that a config fits its tracker.
    """
    if not path.is_file():
        raise InputError(file=path, got="no such file", expected="a Python file", remedy="check the path")
    resolved = path.resolve()
    content = hashlib.sha256(str(resolved).encode() + b"\0" + resolved.read_bytes())
    name = f"_flockscope_{resolved.stem}_{content.hexdigest()[:12]}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, resolved)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses of the file look their module up
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        raise _broken(path, error) from error
    return module


def _from_module(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except (Exception, SystemExit) as error:
        raise _broken(name, error) from error


def _broken(where: object, error: BaseException) -> InputError:
    got = f"{type(error).__name__}: {error}".partition("\n")[0]
    return InputError(file=where or "tracker", got=got, expected="a module that can be imported", remedy="correct it")


def checked(found: Any, spec: str) -> type[Tracker]:
    """The class itself if it is a tracker's, else InputError."""
    fault = _class_fault(found)
    if fault:
        expected = f"a class with reset(context, seed), step(frame, detections) and needs, a tuple out of {NEEDS}"
        raise InputError(file=spec, got=fault, expected=expected, remedy="see docs/trackers.md")
    return found  # type: ignore[no-any-return]


def config_class(tracker: type[Tracker], spec: str) -> type[Config]:
    """The config's class; InputError where the tracker, which was given as `spec`, has no parameters."""
    kind = getattr(tracker, "config_class", None)
    if kind is None:
        remedy = "give the class a config_class that declares them (docs/trackers.md)"
        raise InputError(place="tracker", got=spec, expected="a tracker with parameters", remedy=remedy)
    return cast("type[Config]", kind)


@cache
def code(tracker: type[Tracker]) -> str:
    """A short hash of the file that the class is from, as it was when first asked for; "" where there is none."""
    file = Path(getattr(sys.modules.get(tracker.__module__), "__file__", None) or "")
    return hashlib.sha256(file.read_bytes()).hexdigest()[:12] if file.is_file() else ""


def _class_fault(found: Any) -> str | None:
    """Why this is no tracker's class, or None."""
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
    if not _takes(found, 0 if kind is None else 1):
        return f"__init__{inspect.signature(found)}, called with {'nothing' if kind is None else 'a config'}"
    for name in ("reset", "step"):
        method = getattr(found, name)
        if not callable(method):
            return f"{name} = {method!r}"
        if not _takes(method, 2 + inspect.isfunction(inspect.getattr_static(found, name))):  # a function: self too
            return f"{name}{inspect.signature(method)}"
    return None


def _takes(function: Any, count: int) -> bool:
    """Can this be called with so many arguments? Yes, where its signature cannot be known."""
    try:
        inspect.signature(function).bind(*range(count))
    except TypeError:
        return False
    except ValueError:
        return True
    return True


def own_detector(needs: tuple[str, ...], sequence: Sequence) -> bool:
    """Does the tracker run a detector of its own on this sequence's pictures?"""
    return ("pixels" in needs and sequence.has_images) or ("stereo" in needs and sequence.has_right)


def choose_mode(needs: tuple[str, ...], sequence: Sequence, asked: DetectionMode | None) -> DetectionMode:
    """The detection mode: the asked one if it can work, else image, file, truth in this order; InputError if none."""
    able = [mode for mode in ("image", "file", "truth") if _works(mode, needs, sequence)]
    if asked in able or (asked is None and able):
        return asked or able[0]  # type: ignore[return-value]
    got = f"a tracker that needs {' or '.join(needs)}, and {sequence.name} with {_has(sequence)}"
    expected = f"--detections {asked}" if asked else "detections of some kind"
    remedy = f"try --detections {able[0]}" if able else "take another tracker or source"
    raise InputError(place="--detections", got=got, expected=f"what {expected} needs", remedy=remedy)


def _works(mode: str, needs: tuple[str, ...], sequence: Sequence) -> bool:
    if mode == "image":
        return own_detector(needs, sequence)
    takes = {"boxes", "points"} & set(needs)
    return bool(takes) and (sequence.has_detections if mode == "file" else sequence.load_truth is not None)


def _has(sequence: Sequence) -> str:
    parts = {
        "images": sequence.has_images,
        "a right image": sequence.has_right,
        "detections": sequence.has_detections,
        "truth": sequence.load_truth is not None,
    }
    return ", ".join(name for name, there in parts.items() if there) or "nothing"


def check_detections(detections: Detections, needs: tuple[str, ...]) -> None:
    """Raise InputError on NaN or infinity (frame and row named), or where the tracker needs boxes and has none."""
    rows = len(detections.pos)
    arrays = [a for a in (detections.pos, detections.vel, detections.box, detections.score) if a is not None]
    for a in arrays:
        if not finite(a):
            row = int(np.argwhere(~np.isfinite(a.reshape(len(a), -1)).all(1))[0, 0])
            place = f"frame {detections.index}: detection {row + 1}"
            raise InputError(place=place, got="NaN or infinity", expected="finite numbers", remedy="correct this row")
    if rows and detections.box is None and "points" not in needs:
        place = f"frame {detections.index}"
        raise InputError(place=place, got="points", expected="boxes", remedy="take a tracker that takes points")
