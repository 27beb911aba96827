"""Canonical hashes: the same content gives the same hash in any process, on any platform of the same number format.

Every value is fed to SHA-256 with its kind and size in front, so that no two different values read alike: arrays by
shape and little-endian bytes (every NaN the same), text by its UTF-8, dataclasses and dicts by sorted field names.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.types import Truth

# Raised whenever the same scenario and seed give another truth; golden hashes in the tests guard it.
ENGINE = 2


def canonical_hash(value: Any) -> str:
    """SHA-256, in hex, of None, bool, int, float, str, bytes, arrays, and tuples, lists, dicts, dataclasses of them."""
    h = hashlib.sha256()
    _feed(h, value)
    return h.hexdigest()


def file_hash(content: bytes) -> str:
    """SHA-256 of a file's bytes, in hex."""
    return hashlib.sha256(content).hexdigest()


def scenario_hash(text: str) -> str:
    """Hash of a resolved scenario, given as the text of scenarios.loading.resolve.dump."""
    return canonical_hash(("scenario", text))


def truth_hash(scenario: str, seed: int, repeat: int, truth: Truth | None) -> str:
    """Hash of the resolved scenario (its text), seed, repeat and all truth; the same whatever is rendered."""
    named = None if truth is None else {f.name: getattr(truth, f.name) for f in fields(truth) if f.name != "name"}
    return canonical_hash(("truth", scenario, seed, repeat, named))


def content_hash(truth: str, detections: Any, pixels: Mapping[str, str] | None = None) -> str:
    """Hash of a truth_hash, the detections and, by stream, the hashes of raw pixels before encoding, if any."""
    return canonical_hash(("content", truth, detections, dict(pixels) if pixels else ()))


def dataset_hash(contents: Mapping[str, str]) -> str:
    """Hash of a dataset: of the content hashes by name of sequence, <split>/<name>."""
    return canonical_hash(("dataset", dict(contents)))


class PixelHash:
    """Hash of a stream of pictures as they are added, by their shapes, types and raw bytes; `count` of them so far."""

    def __init__(self) -> None:
        self.count = 0
        self._h = hashlib.sha256()

    def add(self, picture: NDArray[Any]) -> None:
        """The next picture."""
        self.count += 1
        _array(self._h, picture)

    def hex(self) -> str:
        """The hash of all so far."""
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
