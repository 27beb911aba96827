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

# streams with one picture per frame; a frame's sample holds those of them that are stored
FRAME_STREAMS = ("left", "right", "disparity", "ids")

BLOCK = 512  # bytes: a tar holds whole blocks

# name of a file in the tar, its size in bytes, and a call that reads its content
Member = tuple[str, int, Callable[[], bytes]]


@dataclass(frozen=True)
class SequenceItem:
    """A stored sequence to pack."""

    folder: Path  # where it is stored
    bytes: int  # what its members add to a tar
    content: str  # its content hash, which names truth, detections and pixels
    manifest: str  # the hash of its manifest
    # file type of its pictures ("jpg", "png" or "mp4"), None without pictures or with 16-bit streams only
    images: str | None

    @property
    def name(self) -> str:
        """The name <split>/<sequence>."""
        return split_and_name(self.folder)

    @property
    def key(self) -> str:
        """The name as a sample's key; webdataset ends a key at its first dot."""
        return self.name.replace(".", "%2E")


def read_item(folder: Path, samples: str) -> SequenceItem:
    """Returns the item of a stored sequence. samples: "sequence" or "frame"."""
    manifest = read_whole_manifest(folder)
    item = SequenceItem(folder, 0, manifest["content_hash"], manifest["sha256"], manifest.get("images"))
    return replace(item, bytes=sum(_tar_bytes(name, size) for name, size, _ in tar_members(item, samples)))


def _tar_bytes(name: str, size: int) -> int:
    letters = len(name.encode())
    # A name of more than 100 bytes is a member of its own.
    longer = BLOCK + _whole(letters + 1) if letters > tarfile.LENGTH_NAME else 0
    return longer + BLOCK + _whole(size)


def _whole(size: int) -> int:
    return -(-size // BLOCK) * BLOCK


def tar_members(item: SequenceItem, samples: str) -> Iterator[Member]:
    """Yields the members of a stored sequence, in the order of packing.

    All files, the manifest first; or, for samples "frame", the labels and then the pictures of each frame.
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
    """Yields the JSON labels of each frame of a stored sequence, from frame 1; unknown values are null.

    Keys: sequence, fps, image_size, frame, t, and, where stored, people, groups and detections.
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
    return [tables.nan_to_none(value) for value in row.tolist()]
