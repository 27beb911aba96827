"""Canonical hashes: equal content gives the same SHA-256 in any process and on any platform.

Each value is hashed with its kind and size in front, so that different values never produce the same bytes. An array
is hashed by number type, shape and little-endian bytes, with all NaN alike; text by its UTF-8; a dict by sorted keys; a
dataclass as the dict of its fields.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.types import Truth

# Raise this whenever the same scenario and seed give another truth; golden hashes in the tests check that.
ENGINE = 2


def canonical_hash(value: Any) -> str:
    """Return the SHA-256, in hex, of a value.

    The value may be None, bool, int, float, str, bytes, an array of numbers or bools, or a tuple, list, dict or
    dataclass of such values; a tuple and a list with equal items have the same hash. Raises TypeError for other types.
    """
    h = hashlib.sha256()
    _feed(h, value)
    return h.hexdigest()


def file_hash(content: bytes) -> str:
    """Return the SHA-256 of a file's bytes, in hex."""
    return hashlib.sha256(content).hexdigest()


def scenario_hash(text: str) -> str:
    """Return the hash of a resolved scenario, given as the TOML text that `dump` of scenarios.loading writes."""
    return canonical_hash(("scenario", text))


def truth_hash(scenario: str, seed: int, repeat: int, truth: Truth | None) -> str:
    """Return the hash of a resolved scenario's text, seed, repeat and truth; it does not depend on what is rendered.

    All fields of the truth count but its name. A truth of None counts as None.
    """
    named = None if truth is None else {f.name: getattr(truth, f.name) for f in fields(truth) if f.name != "name"}
    return canonical_hash(("truth", scenario, seed, repeat, named))


def content_hash(truth: str, detections: Any, pixels: Mapping[str, str] | None = None) -> str:
    """Return the hash of a whole sequence: its truth_hash, its detections, and the raw pixels of its streams.

    pixels: hash of the pictures before encoding, by stream; None or empty without pictures. The hash is therefore the
    same for jpg, png and mp4.
    """
    return canonical_hash(("content", truth, detections, dict(pixels) if pixels else ()))


def dataset_hash(contents: Mapping[str, str]) -> str:
    """Return the hash of a dataset, given the content hash of each sequence by its name <split>/<sequence>."""
    return canonical_hash(("dataset", dict(contents)))


class PixelHash:
    """A hash over pictures that are added one by one: their number types, shapes and raw bytes.

    State: the SHA-256 so far, and `count`, the number of pictures added.
    """

    def __init__(self) -> None:
        self.count = 0
        self._h = hashlib.sha256()

    def add(self, picture: NDArray[Any]) -> None:
        """Add the next picture, an array of any shape and number type."""
        self.count += 1
        _array(self._h, picture)

    def hex(self) -> str:
        """Return the hash of all pictures added so far, in hex."""
        return self._h.hexdigest()


def _feed(h: Any, value: Any) -> None:
    match value:
        case None:
            h.update(b"N;")
        case bool() | np.bool_():
            h.update(b"T;" if value else b"F;")
        case int() | np.integer():
            h.update(f"i{int(value)};".encode())
        case float() | np.floating():
            h.update(f"f{'nan' if value != value else float(value).hex()};".encode())
        case str():
            _sized(h, b"s", value.encode())
        case bytes():
            _sized(h, b"b", value)
        case np.ndarray():
            _array(h, value)
        case tuple() | list():
            h.update(f"t{len(value)};".encode())
            for item in value:
                _feed(h, item)
        case dict():
            h.update(f"d{len(value)};".encode())
            for key in sorted(value):
                _feed(h, key)
                _feed(h, value[key])
        case _ if is_dataclass(value) and not isinstance(value, type):
            _feed(h, {f.name: getattr(value, f.name) for f in fields(value)})
        case _:
            raise TypeError(f"no canonical form of {type(value).__name__}")


def _sized(h: Any, kind: bytes, content: bytes) -> None:
    h.update(kind + f"{len(content)};".encode())
    h.update(content)


def _array(h: Any, a: NDArray[Any]) -> None:
    if a.dtype.kind not in "biuf":
        raise TypeError(f"no canonical form of an array of {a.dtype}")
    if a.dtype.kind == "f" and np.isnan(a).any():
        a = np.where(np.isnan(a), np.array(np.nan, a.dtype), a)
    little = a.dtype.newbyteorder("<")
    h.update(f"a{little.str}{a.shape};".encode())
    h.update(np.ascontiguousarray(a, little).tobytes())
