"""Checks a manifest.json whose seal is intact: its values, so that no reader meets a value of another kind, and, for
exports, that it names every file of the sequence.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from scenarios.errors import InputError
from scenarios.limits import FRAME_RATES, FRAMES, INTEGER, PICTURE_SIDE, PICTURE_SIZES, SCALES, fits_picture
from sim.io.files.value_check import TEXT, Rule, Rules, check_values, list_of, number, one_of, or_none, whole
from sim.io.store.manifest import MANIFEST, REDO, read_manifest
from sim.io.store.streams import IMAGES, STREAMS, file_name
from sim.types import BACKGROUNDS

SIDES = list_of(whole(1, PICTURE_SIDE))
SIZE = Rule(lambda v: SIDES.accepts(v) and len(v) == 2 and fits_picture(*v), f"[width, height], {PICTURE_SIZES}")

# what each value of the key "sequence" must be
SEQUENCE: Rules = {
    "name": TEXT,
    "fps": number(*FRAME_RATES),
    "length": whole(0, FRAMES),
    "image_size": or_none(SIZE),
    "px_per_m": or_none(number(*SCALES)),
}
# what other values must be; keys that a manifest may lack are checked if they are there
TOP: Rules = {
    "seed": whole(0, INTEGER),
    "repeat": whole(0, INTEGER),
    "truth_hash": TEXT,
    "content_hash": TEXT,
    "scenario_hash": TEXT,
    "streams": list_of(one_of(*STREAMS)),
    "images": or_none(one_of(*IMAGES)),
    "stride": whole(1, FRAMES),
}


def check_manifest(path: Path, manifest: dict[str, Any]) -> dict[str, Any]:
    """Returns the manifest unchanged; raises InputError for a value that readers do not expect."""
    check_values(path, manifest["sequence"], SEQUENCE, REDO, inside="sequence")
    check_values(path, manifest, TOP, REDO)
    if manifest.get("streams") and manifest["sequence"]["image_size"] is None:
        raise InputError(
            file=path, place="sequence.image_size", got="null", expected="the size of the pictures", remedy=REDO
        )
    return manifest


def read_whole_manifest(folder: Path) -> dict[str, Any]:
    """Returns the manifest of a sequence that is exported: it must name every file of the sequence."""
    path = folder / MANIFEST
    manifest = check_manifest(path, read_manifest(folder))
    length, images = manifest["sequence"]["length"], manifest.get("images") or "png"
    wanted = ["scenario.toml", "seqinfo.ini"]
    for stream in manifest.get("streams", ()):
        count = BACKGROUNDS if stream == "background" else length
        wanted += [file_name(stream, images, k) for k in range(1, count + 1)]
    missing = [name for name in wanted if name not in manifest["files"]]
    if missing:
        got = f"no {missing[0]}" + (f" and {len(missing) - 1} more" if len(missing) > 1 else "")
        raise InputError(file=path, place="files", got=got, expected="every file of the sequence", remedy=REDO)
    # A stranger's dataset must not make an export read files elsewhere.
    inside = folder.resolve()
    for name in (MANIFEST, *manifest["files"]):
        if not (folder / name).resolve().is_relative_to(inside):
            raise InputError(
                file=folder / name, got="a link that leads out of the sequence", expected="a file of the sequence",
                remedy="export a copy that holds the files themselves (cp -rL)",
            )  # fmt: skip
    return manifest
