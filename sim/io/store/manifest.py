"""manifest.json, written last: a stored sequence is complete if and only if it has one.

It holds the hash of every file, the identity of the sequence, versions and the CPU's instruction level. It holds no
time, host or path, so the same seed, scenario and versions give the same bytes. Its values are checked, so that no
reader meets a value of another kind; for exports also that it names every file of the sequence.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from scenarios.errors import InputError
from scenarios.limits import FRAME_RATES, FRAMES, INTEGER, PICTURE_SIDE, PICTURE_SIZES, SCALES, fits_picture
from sim import hashing
from sim.io.files import tables
from sim.io.files.own_files import is_ours
from sim.io.files.tables import TEXT, Rule, Rules, check_values, list_of, number, one_of, or_none, whole
from sim.io.store import seal
from sim.io.store.seal import with_hash as with_hash
from sim.io.store.streams import IMAGES, STREAMS, check_streams, coding, file_name, is_picture
from sim.types import BACKGROUNDS

SCHEMA = 1
MANIFEST = "manifest.json"
# what every manifest.json of ours has, and no other program writes
MARKS: Rules = {"scenario_hash": TEXT, "content_hash": TEXT}

REDO = "run the same `flockscope generate` again"


def is_sequence(folder: Path) -> bool:
    """Returns True if the folder is a stored sequence, perhaps an incomplete one."""
    return (folder / MANIFEST).is_file() or (folder / "scenario.toml").is_file()


def is_own_sequence(folder: Path) -> bool:
    """Returns True if flockscope wrote the sequence: its manifest or, without a readable one, a table is ours."""
    return any(is_ours(path, MARKS) for path in (folder / MANIFEST, *folder.rglob("*.parquet")))


def identity(scenario: str, seed: int, repeat: int, streams: Iterable[str] = (), images: str = "jpg") -> dict[str, Any]:
    """Returns the fields of a manifest that identify a sequence.

    scenario: TOML text of the resolved scenario. repeat: number of the suite entry's copy, 0 without copies.
    """
    wanted = check_streams(streams, images)
    return {
        "format": tables.FORMAT,
        "schema": SCHEMA,
        "engine": hashing.ENGINE,
        "seed": seed,
        "repeat": repeat,
        "scenario_hash": hashing.scenario_hash(scenario),
        "streams": list(wanted),
        "images": coding(wanted, images),
    }


def read_manifest(folder: Path) -> dict[str, Any]:
    """Reads the manifest.json of a sequence folder, and checks its seal, but no other file."""
    path = folder / MANIFEST
    if not path.is_file():
        raise InputError(file=path, got="missing", expected="the manifest of a complete sequence", remedy=REDO)
    manifest = tables.read_document(path, REDO)
    missing = {"format", "sequence", "files", "seed", "repeat", "scenario_hash", "truth_hash", "content_hash", "sha256"}
    missing -= manifest.keys()
    if missing:
        raise InputError(file=path, got=f"no {', '.join(sorted(missing))}", expected="all keys", remedy=REDO)
    seal.require_intact(path, manifest, REDO)
    return manifest


def damaged_files(folder: Path, manifest: dict[str, Any], *, pictures: bool = True) -> Iterator[InputError]:
    """Yields an error for each file of the manifest that is missing or altered.

    pictures: False compares only the size of pictures; their hash is checked when they are read.
    """
    size_only = () if pictures else tuple(filter(is_picture, manifest["files"]))
    return seal.damaged_files(folder, manifest["files"], seal=MANIFEST, remedy=REDO, size_only=size_only)


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
