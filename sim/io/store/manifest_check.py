"""Checks the values of a manifest.json whose seal is intact, so that no reader meets a value of another kind."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from scenarios.errors import InputError
from scenarios.limits import FRAME_RATES, FRAMES, INTEGER, PICTURE_SIDE, PICTURE_SIZES, SCALES, fits_picture
from sim.io.files.value_check import TEXT, Rule, Rules, check_values, list_of, number, one_of, or_none, whole
from sim.io.store.manifest import REDO
from sim.io.store.streams import IMAGES, STREAMS

SIDES = list_of(whole(1, PICTURE_SIDE))
SIZE = Rule(lambda v: SIDES.accepts(v) and len(v) == 2 and fits_picture(*v), f"[width, height], {PICTURE_SIZES}")

SEQUENCE: Rules = {
    "name": TEXT,
    "fps": number(*FRAME_RATES),
    "length": whole(0, FRAMES),
    "image_size": or_none(SIZE),
    "px_per_m": or_none(number(*SCALES)),
}
"""What each value of the key "sequence" must be."""
TOP: Rules = {
    "seed": whole(0, INTEGER),
    "repeat": whole(0, INTEGER),
    "truth_hash": TEXT,
    "content_hash": TEXT,
    "scenario_hash": TEXT,
    "streams": list_of(one_of(*STREAMS)),
    "images": or_none(one_of(*IMAGES)),
}
"""What other values must be; keys that a manifest may lack are checked if they are there."""


def check_manifest(path: Path, manifest: dict[str, Any]) -> dict[str, Any]:
    """Return the manifest unchanged if its values are of the kinds that readers expect; raise InputError otherwise.

    path: of the manifest.json, for the message. Checked are the values of "sequence" and seed, repeat, hashes, streams
    and images. Pictures need an image size.
    """
    check_values(path, manifest["sequence"], SEQUENCE, REDO, inside="sequence")
    check_values(path, manifest, TOP, REDO)
    if manifest.get("streams") and manifest["sequence"]["image_size"] is None:
        raise InputError(
            file=path, place="sequence.image_size", got="null", expected="the size of the pictures", remedy=REDO
        )
    return manifest
