"""Checks the values of a manifest.json whose seal is intact, so that no reader meets a value of another kind."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from scenarios.errors import InputError
from scenarios.limits import FRAME_RATES, FRAMES, PICTURE_SIZES, SCALES, fits_picture, is_number
from sim.io.store.manifest import REDO
from sim.io.store.streams import IMAGES, STREAMS


def _whole(low: int, high: int) -> Callable[[Any], bool]:
    return lambda v: isinstance(v, int) and not isinstance(v, bool) and low <= v <= high


def _number(low: float, high: float) -> Callable[[Any], bool]:
    return lambda v: is_number(v, low, high)


def _or_none(right: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda v: v is None or right(v)


def _list_of(right: Callable[[Any], bool], length: int | None = None) -> Callable[[Any], bool]:
    return lambda v: isinstance(v, list) and length in (None, len(v)) and all(map(right, v))


def _text(value: Any) -> bool:
    return isinstance(value, str)


def _size(value: Any) -> bool:
    return _list_of(_whole(1, FRAMES), 2)(value) and fits_picture(*value)


SEQUENCE: dict[str, tuple[Callable[[Any], bool], str]] = {
    "name": (_text, "a text"),
    "fps": (_number(*FRAME_RATES), "a number from {:g} to {:g}".format(*FRAME_RATES)),
    "length": (_whole(0, FRAMES), f"a whole number from 0 to {FRAMES}"),
    "image_size": (_or_none(_size), f"null, or [width, height]: {PICTURE_SIZES}"),
    "px_per_m": (_or_none(_number(*SCALES)), "null, or a number from {:g} to {:g}".format(*SCALES)),
}
"""What each value of the key "sequence" must be: whether a value is right, and words for it."""
TOP: dict[str, tuple[Callable[[Any], bool], str]] = {
    "seed": (_whole(0, 2**63 - 1), "a whole number from 0 on"),
    "repeat": (_whole(0, 2**63 - 1), "a whole number from 0 on"),
    "truth_hash": (_text, "a hash"),
    "content_hash": (_text, "a hash"),
    "scenario_hash": (_text, "a hash"),
    "streams": (_list_of(lambda v: v in STREAMS), f"some of {', '.join(STREAMS)}"),
    "images": (_or_none(lambda v: v in IMAGES), f"null, or {' or '.join(IMAGES)}"),
}
"""What other values must be; keys that a manifest may lack are checked if they are there."""


def check_manifest(path: Path, manifest: dict[str, Any]) -> dict[str, Any]:
    """Return the manifest unchanged if its values are of the kinds that readers expect; raise InputError otherwise.

    path: of the manifest.json, for the message. Checked are the values of "sequence" and seed, repeat, hashes, streams
    and images. Pictures need an image size.
    """
    about = manifest["sequence"]
    if not isinstance(about, dict):
        raise InputError(file=path, place="sequence", got=repr(about), expected="an object", remedy=REDO)
    for table, rules, prefix in ((about, SEQUENCE, "sequence."), (manifest, TOP, "")):
        for key, (right, expected) in rules.items():
            if (key in table or prefix) and not right(table.get(key)):
                got = repr(table.get(key)) if key in table else "nothing"
                raise InputError(file=path, place=prefix + key, got=got, expected=expected, remedy=REDO)
    if manifest.get("streams") and about["image_size"] is None:
        raise InputError(
            file=path, place="sequence.image_size", got="null", expected="the size of the pictures", remedy=REDO
        )
    return manifest
