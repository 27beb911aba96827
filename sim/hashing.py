"""Canonical hashes: equal content gives the same SHA-256 in any process and on any platform.

Each value is hashed with its kind and size in front, so that values of different kinds or sizes never produce the same
bytes. An array is hashed by number type, shape and little-endian bytes, with all NaN alike; text by its UTF-8; a dict
by sorted keys; a dataclass as the dict of its fields; a tuple as a list.
"""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass
from functools import cache, lru_cache
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.types import Detections, Truth

# Raise this whenever the same scenario and seed give another truth or other detections; golden hashes check that.
ENGINE = 8


def canonical_hash(value: Any) -> str:
    """Returns the SHA-256 of a value as 64 hex digits; equal content gives the same hash on any machine.

    The value may be None, bool, int, float, str, bytes, an array of numbers or bools, or a tuple, list, dict or
    dataclass of such values. A tuple and a list with equal items have the same hash, and so have a dataclass and the
    dict of its fields. All nan are alike, and the order of a dict does not count. An int and a float, or arrays of
    different number types or shapes, have different hashes. Raises TypeError for other types (also arrays of complex
    numbers, texts or objects), and for dict keys that cannot be sorted.
    """
    h = hashlib.sha256()
    _feed(h, value)
    return h.hexdigest()


def file_hash(content: bytes | Path) -> str:
    """Returns the SHA-256 of the bytes of a file, as 64 hex digits; a path is read in parts."""
    if isinstance(content, bytes):
        return hashlib.sha256(content).hexdigest()
    with content.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def scenario_hash(text: str) -> str:
    """Returns the SHA-256 (64 hex digits) that names a scenario.

    text: TOML of the resolved scenario as `dump` of scenarios.loading writes it. Another text with the same meaning
    has another hash.
    """
    return canonical_hash(("scenario", text))


def truth_hash(scenario: str, seed: int, repeat: int, truth: Truth | None) -> str:
    """Returns the SHA-256 (64 hex digits) of a scenario, seed, repeat and truth; what is rendered does not matter.

    scenario: TOML text of the resolved scenario. repeat: number of the suite entry's copy, 0 without copies. All fields
    of the truth count except its name, camera, scene, and `unscored`, the rows left out of the scores. truth: None for
    a sequence without truth, which has a different hash from any truth.
    """
    counted = [f.name for f in fields(Truth) if f.name not in ("name", "unscored", "camera", "scene")]
    named = None if truth is None else {name: getattr(truth, name) for name in counted}
    return canonical_hash(("truth", scenario, seed, repeat, named))


def labels_hash(truth: Truth) -> str:
    """Returns the SHA-256 (64 hex digits) of a recording's labels as read: frame rate, length, and of each row frame,
    id, group, position and box.

    Nothing else counts: not the name, visibility or events, nor what is computed from the labels (velocities, hulls).
    The image scale counts only where it turned positions in px into m.
    """
    read = (truth.frame, truth.id, truth.group, truth.pos, truth.box)
    return canonical_hash(("labels", truth.fps, truth.length, *read))


def detections_hash(detections: Iterable[Detections | None]) -> str:
    """Returns the SHA-256 (64 hex digits) of the detections of each frame: boxes (positions without boxes) and scores.

    Positions that follow from boxes and a camera do not count: their last bits depend on the processor.
    """
    read = ((d.pos if d.box is None else d.box, d.score) if d is not None else None for d in detections)
    return canonical_hash(("detections", [*read]))


def content_hash(truth: str, detections: Any, pixels: Mapping[str, str] | None = None) -> str:
    """Returns the SHA-256 (64 hex digits) of a sequence: its truth, detections and raw pixels.

    truth: the sequence's truth_hash. detections: list of Detections, one per frame, empty without a detector. pixels:
    hash of the pictures before encoding, by stream name; None or empty without pictures. The hash is therefore the same
    for jpg, png and mp4. Raises TypeError as canonical_hash.
    """
    return canonical_hash(("content", truth, detections, dict(pixels) if pixels else ()))


def dataset_hash(contents: Mapping[str, str]) -> str:
    """Returns the SHA-256 (64 hex digits) of a dataset.

    contents: content_hash of each sequence by its name <split>/<sequence>; the order does not count.
    """
    return canonical_hash(("dataset", dict(contents)))


class PixelHash:
    """A hash over pictures that are added one by one: their number types, shapes and raw bytes, in order.

    State: the SHA-256 so far, and `count`, the number of pictures added.
    """

    def __init__(self) -> None:
        self.count = 0
        self._h = hashlib.sha256()

    def add(self, picture: NDArray[Any]) -> None:
        """Adds the next picture, an array of numbers or bools of any shape.

        Raises TypeError for an array of another type; `count` is increased even then.
        """
        self.count += 1
        _array(self._h, picture)

    def hex(self) -> str:
        """Returns the SHA-256 (64 hex digits) of all pictures added so far, in the order of adding.

        If no picture was added, it is the SHA-256 of no bytes.
        """
        return self._h.hexdigest()


def _feed(h: Any, value: Any) -> None:
    match value:
        case np.ndarray():
            _array(h, value)
        case None:
            h.update(b"N;")
        case bool() | np.bool_():
            h.update(b"T;" if value else b"F;")
        case int() | np.integer():
            h.update(f"i{int(value)};".encode())
        case float() | np.floating():
            h.update(f"f{'nan' if value != value else float(value).hex()};".encode())
        case str():
            _sized(h, b"s", value.encode("utf-8", "surrogatepass"))
        case bytes():
            _sized(h, b"b", value)
        case tuple() | list():
            h.update(f"t{len(value)};".encode())
            floats = len(value) > 1 and all(type(item) is np.ndarray and item.dtype == np.float64 for item in value)
            known = floats and not np.isnan(np.concatenate([item.ravel() for item in value])).any()  # one look for all
            for item in value:
                _array(h, item, known) if known else _feed(h, item)
        case dict():
            h.update(f"d{len(value)};".encode())
            for key in sorted(value):
                _feed(h, key)
                _feed(h, value[key])
        case _ if is_dataclass(value) and not isinstance(value, type):
            names = _field_names(type(value))
            h.update(f"d{len(names)};".encode())
            for name, key in names:
                h.update(key)
                _feed(h, getattr(value, name))
        case _:
            raise TypeError(f"no canonical form of {type(value).__name__}")


@cache
def _field_names(kind: Any) -> list[tuple[str, bytes]]:
    """Returns the sorted field names of a dataclass, and the bytes by which each is hashed."""
    return [(name, f"s{len(name)};{name}".encode()) for name in sorted(f.name for f in fields(kind))]


def _sized(h: Any, kind: bytes, content: bytes) -> None:
    h.update(kind + f"{len(content)};".encode())
    h.update(content)


def _array(h: Any, a: NDArray[Any], known: bool = False) -> None:
    """Hashes an array; known: True if it has no nan."""
    if a.dtype.kind not in "biuf":
        raise TypeError(f"no canonical form of an array of {a.dtype}")
    if not known and a.dtype.kind == "f" and np.isnan(a).any():
        a = np.where(np.isnan(a), np.array(np.nan, a.dtype), a)
    if not a.dtype.str.startswith(("<", "|")):
        a = a.astype(a.dtype.newbyteorder("<"))
    h.update(f"a{a.dtype.str}{a.shape};".encode() + a.tobytes())


LIBRARIES = ("numpy", "scipy", "numba", "pymunk", "pyarrow", "pydantic")
PICTURE_LIBRARIES = ("opencv-python-headless", "av")
DISTRIBUTION, PACKAGES = "flockscope", ("scenarios", "sim", "tracking")


@lru_cache(maxsize=2)
def versions(drawn: bool) -> dict[str, str]:
    """Returns the versions of Python, flockscope and the libraries, by name.

    drawn: True adds the libraries that only pictures depend on.
    """
    names = (DISTRIBUTION, *LIBRARIES, *(PICTURE_LIBRARIES if drawn else ()))
    return {"python": platform.python_version(), **installed(names)}


def installed(names: Iterable[str]) -> dict[str, str]:
    """Returns the version of each named distribution, by name; "unknown" for one that is not installed."""
    found = dict.fromkeys(names, "unknown")
    for name in found:
        with suppress(metadata.PackageNotFoundError):
            found[name] = metadata.version(name)
    return found


@cache
def runtime() -> dict[str, str]:
    """Returns by name what must be equal on two machines so that they produce the same bytes.

    These are the versions of Python, flockscope and all libraries, and under "sources" the `source_hash`.
    """
    return {**versions(drawn=True), "sources": source_hash(Path(__file__).resolve().parents[1])}


def source_hash(root: Path) -> str:
    """Returns 12 hex digits of the SHA-256 over the .py, .toml and .tsv files of our packages below the folder `root`,
    without those of commands and drawing, which decide no result."""
    h = hashlib.sha256()
    for package in PACKAGES:
        for path in sorted((root / package).rglob("*")):
            shown = {"app", "drawing"} & {*path.relative_to(root).parts}
            if path.suffix in (".py", ".toml", ".tsv") and not shown:
                h.update(f"{path.relative_to(root).as_posix()}\0".encode() + path.read_bytes() + b"\0")
    return h.hexdigest()[:12]
