"""The samples of a WebDataset export: the tar members of one stored sequence, and the JSON labels of one frame."""

from __future__ import annotations

import tarfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from sim.io.files import tables
from sim.io.pictures.stored_pictures import StoredPictures
from sim.io.source import split_and_name
from sim.io.store.manifest import MANIFEST, read_manifest
from sim.io.store.manifest_check import read_whole_manifest
from sim.io.store.sequence_folder import open_sequence
from sim.io.store.streams import file_name
from sim.types import Array, Detections, FrameTruth, Groups

FRAME_STREAMS = ("left", "right", "disparity", "ids")
"""Streams with one picture per frame; a frame's sample holds those of them that are stored."""

BLOCK = 512  # bytes: a tar holds whole blocks

Member = tuple[str, int, Callable[[], bytes]]
"""Name of a file in the tar, its size in bytes, and a call that reads its content."""


@dataclass(frozen=True)
class SequenceItem:
    """A stored sequence to pack.

    folder: where it is stored. bytes: what its members add to a tar. content: its content hash, which names truth,
    detections and pixels. manifest: the hash of its manifest. images: file type of its pictures ("jpg", "png" or
    "mp4"), None without pictures or with 16-bit streams only.
    """

    folder: Path
    bytes: int
    content: str
    manifest: str
    images: str | None

    @property
    def name(self) -> str:
        """The name <split>/<sequence>, the last two parts of the folder's path."""
        return split_and_name(self.folder)

    @property
    def key(self) -> str:
        """The name <split>/<sequence> as a sample's key; dots become %2E because webdataset ends a key at its first
        dot.
        """
        return self.name.replace(".", "%2E")


def read_item(folder: Path, samples: str) -> SequenceItem:
    """Return the item (size, hashes, file type) of a stored sequence's folder.

    samples: "sequence" or "frame"; for frames, truth and detections are read. Raises InputError if its manifest is
    missing, altered, of another format or not whole, or a file that is read is altered.
    """
    manifest = read_whole_manifest(folder)
    item = SequenceItem(folder, 0, manifest["content_hash"], manifest["sha256"], manifest.get("images"))
    return replace(item, bytes=sum(_tar_bytes(name, size) for name, size, _ in tar_members(item, samples)))


def _tar_bytes(name: str, size: int) -> int:
    """Returns what a member adds to a tar: a header and its content; a name over 100 bytes is a member of its own."""
    letters = len(name.encode())
    longer = BLOCK + _whole(letters + 1) if letters > tarfile.LENGTH_NAME else 0
    return longer + BLOCK + _whole(size)


def _whole(size: int) -> int:
    return -(-size // BLOCK) * BLOCK


def tar_members(item: SequenceItem, samples: str) -> Iterator[Member]:
    """Yield the tar members of a stored sequence as (name, bytes, function that reads them), in the order of packing.

    item: the sequence; names begin with its key. samples "sequence": every file of the sequence, the manifest first.
    Otherwise, for each frame, its JSON labels and then its stored pictures (left, right, disparity, ids). Iterating
    raises InputError if the manifest is invalid; for frames also if a file of labels or detections differs from it. The
    reading functions raise InputError if their file is missing or differs from the manifest.
    """
    manifest = read_manifest(item.folder)
    stored = StoredPictures(item.folder, manifest)
    if samples == "sequence":
        path = item.folder / MANIFEST
        yield f"{item.key}.{MANIFEST}", path.stat().st_size, path.read_bytes
        for name, facts in manifest["files"].items():
            yield f"{item.key}.{name.replace('/', '.')}", facts["bytes"], partial(stored.body, name)
        return
    streams = [stream for stream in stored.streams if stream in FRAME_STREAMS]
    for index, body in enumerate(frame_labels(item.folder, manifest), 1):
        yield f"{item.key}/{index:06d}.json", len(body), partial(bytes, body)
        for stream in streams:
            name = file_name(stream, stored.images, index)
            size = manifest["files"][name]["bytes"]
            yield f"{item.key}/{index:06d}.{stream}{Path(name).suffix}", size, partial(stored.body, name)


def frame_labels(folder: Path, manifest: dict[str, Any]) -> Iterator[bytes]:
    """Yield the JSON object of each frame of a stored sequence, from frame 1, as UTF-8 bytes; unknown values are null.

    manifest: that of the folder. Keys: sequence (name), fps, image_size [width, height] px, frame (from 1), t in s.
    people, where the truth is stored: id, group (-1 for alone), box (left, top, width, height in px, amodal), x, y in
    m, vx, vy in m/s (left out if the truth has no velocities), visibility. groups, likewise: id, members (person ids),
    hull (list of [x, y]) in m; null if unknown. detections, where they are stored: score, box, plane, and x, y, (z) in
    m or px by the plane.

    Iterating raises InputError if a file of the sequence is missing or altered, AssertionError for a truth without
    positions.
    """
    sequence = open_sequence(folder)
    truth = sequence.truth
    about = {"sequence": sequence.name, "fps": sequence.fps, "image_size": manifest["sequence"]["image_size"]}
    for frame in sequence.without_pictures():
        row: dict[str, Any] = {**about, "frame": frame.index, "t": frame.t}
        if truth is not None:
            here = truth.at(frame.index)
            row |= {"people": list(_people(here)), "groups": _groups(here.groups)}
        if frame.detections is not None:
            row["detections"] = list(_detections(frame.detections))
        yield tables.json_text(row).encode()


def _people(truth: FrameTruth) -> Iterator[dict[str, Any]]:
    assert truth.pos is not None, "simulated people have positions"
    for k, (number, group) in enumerate(zip(truth.id.tolist(), truth.group.tolist(), strict=True)):
        row = {"id": number, "group": group, "box": None if truth.box is None else _numbers(truth.box[k])}
        row |= dict(zip(("x", "y"), _numbers(truth.pos[k]), strict=True))
        if truth.vel is not None:
            row |= dict(zip(("vx", "vy"), _numbers(truth.vel[k]), strict=True))
        yield {**row, "visibility": tables.nan_to_none(float(truth.visibility[k]))}


def _groups(groups: Groups | None) -> list[dict[str, Any]] | None:
    if groups is None:
        return None
    rows = zip(groups.id.tolist(), groups.members, groups.hull, strict=True)
    return [{"id": number, "members": members.tolist(), "hull": hull.tolist()} for number, members, hull in rows]


def _detections(found: Detections) -> Iterator[dict[str, Any]]:
    for k, score in enumerate(found.score.tolist()):
        row = {"score": score, "box": None if found.box is None else _numbers(found.box[k])}
        yield {**row, "plane": found.plane, **dict(zip("xyz", _numbers(found.pos[k]), strict=False))}


def _numbers(row: Array) -> list[float | None]:
    """Return the values of `row`, an array (N,), as a list of JSON numbers, None for nan."""
    return [tables.nan_to_none(value) for value in row.tolist()]
