"""WebDataset export: packs stored sequences into tar shards that the library webdataset streams.

A sample is a whole sequence (all its files, hence its content hash), or one frame with its labels; all files of a
sample share a key and stand next to each other. The same dataset gives the same bytes: members are sorted by sequence
and have no times or owners. A shard appears complete or not at all, with a .json beside it that describes it.
index.json, written last, lists all shards.
"""

from __future__ import annotations

import hashlib
import io
import re
import tarfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

from scenarios.errors import InputError
from sim import hashing
from sim.io.files import tables
from sim.io.files.atomic import lock_folder, new_file, remove_partials, write_file
from sim.io.files.own_files import Marks, refuse_foreign_file
from sim.io.pictures.stored_pictures import StoredPictures
from sim.io.source import sequence_folders, split_and_name
from sim.io.store.seal import MANIFEST, read_manifest, read_whole_manifest
from sim.io.store.sequence_folder import open_sequence
from sim.streams import file_name
from sim.types import Detections, FrameTruth, Groups

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
            row |= {"people": _people(here), "groups": None if here.groups is None else _groups(here.groups)}
        if frame.detections is not None:
            row["detections"] = _detections(frame.detections)
        yield tables.json_text(row).encode()


def _people(truth: FrameTruth) -> list[dict[str, Any]]:
    columns: dict[str, Any] = {"id": truth.id, "group": truth.group, "box": truth.box}
    for names, values in ((("x", "y"), truth.pos), (("vx", "vy"), truth.vel)):
        if values is not None:
            columns |= dict(zip(names, values.T, strict=True))
    return _rows({**columns, "visibility": truth.visibility}, len(truth.id))


def _groups(groups: Groups) -> list[dict[str, Any]]:
    return _rows({"id": groups.id, "members": groups.members, "hull": groups.hull}, len(groups.id))


def _detections(found: Detections) -> list[dict[str, Any]]:
    place = dict(zip("xyz", found.pos.T, strict=False))
    planes = [found.plane] * len(found.score)
    return _rows({"score": found.score, "box": found.box, "plane": planes, **place}, len(found.score))


def _rows(columns: dict[str, Any], count: int) -> list[dict[str, Any]]:
    """Returns each row of some columns as a dict; a column that is None is unknown."""
    return [
        {name: None if values is None else tables.plain(values[k]) for name, values in columns.items()}
        for k in range(count)
    ]


SAMPLES = ("sequence", "frame")
UNITS = {"": 1, "k": 10**3, "M": 10**6, "G": 10**9}
RECORD = tarfile.RECORDSIZE
INDEX = "index.json"
INDEX_MARKS: Marks = {"content_hash": str, "shards": list}
SHARD_MARKS: Marks = {"manifests": str, "sequences": dict}  # what every index.json, and every .json of a shard, has

Progress = Callable[[int, int, str], None]


def webdataset(
    source: str | Path, out: str | Path, *, shard_size: int = 10**9, samples: str = "sequence",
    progress: Progress | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Packs a generated dataset into OUT/shard-000000.tar, …, and writes OUT/index.json.

    Args:
        source: A generated sequence or dataset.
        out: The folder. Complete shards of an earlier run are kept.
        shard_size: Bytes that a shard may have. A sequence is never divided, so a shard of one sequence may be larger.
        samples: "sequence" (all files of a sequence) or "frame" (one frame's labels and pictures).
        progress: Called as progress(shards done, shards in all, name of the last one) after each shard.

    Returns:
        The index: format, samples, content_hash, and shards, the content of the .json beside each shard.
    """
    items, root = _items(Path(source), samples), Path(out)
    shards = list(_shards(items, shard_size))
    with lock_folder(root):
        remove_partials(root)
        plan = [_facts(samples, number, some) for number, some in enumerate(shards)]
        _reject_other_shards(root, plan)
        for number, (facts, some) in enumerate(zip(plan, shards, strict=True), 1):
            plan[number - 1] = _complete_shard(root, facts) or _write_shard(root, facts, some)
            if progress is not None:
                progress(number, len(plan), facts["name"])
        hashes = {name: value for facts in plan for name, value in facts["sequences"].items()}
        index = {"format": tables.FORMAT, "samples": samples, "content_hash": hashing.dataset_hash(hashes)}
        index["shards"] = plan
        write_file(root / INDEX, tables.json_document(index))
    return index


def size_of(text: str) -> int:
    """Returns the bytes that a text such as `500MB`, `1.5 GB` or `3 kB` names; units are powers of 1000."""
    found = re.fullmatch(r"([0-9]{1,12}(?:\.[0-9]{1,6})?)\s*(?:([kMG])?B)?", text.strip())
    size = 0 if found is None else round(float(found[1]) * UNITS[found[2] or ""])
    if size < 1:
        raise InputError(
            place="--shard-size", got=repr(text), expected="bytes, kB, MB or GB above 0", remedy="write 500MB"
        )
    return size


def _items(source: Path, samples: str) -> list[SequenceItem]:
    found = sorted((read_item(p, samples) for p in sequence_folders(source, "generated")), key=lambda item: item.name)
    twice = next((a.name for a, b in pairwise(found) if a.name == b.name), None)
    if twice is not None:
        raise InputError(file=source, got=f"two sequences {twice}", expected="unique names", remedy="export them apart")
    video = next((item for item in found if samples == "frame" and item.images == "mp4"), None)
    if video is not None:
        raise InputError(
            file=video.folder, place="--samples frame", got="videos", expected="pictures by frame",
            remedy="generate with --images jpg or png, or export --samples sequence",
        )  # fmt: skip
    return found


def _shards(items: list[SequenceItem], size: int) -> Iterator[list[SequenceItem]]:
    """Yields the consecutive sequences of each shard, as many as fit into a tar of `size` bytes, at least one."""
    some: list[SequenceItem] = []
    full = 0
    for item in items:
        if some and -(-(full + item.bytes + 2 * BLOCK) // RECORD) * RECORD > size:  # a tar ends with two empty blocks
            yield some
            some, full = [], 0
        some.append(item)
        full += item.bytes
    yield some


def _facts(samples: str, number: int, items: list[SequenceItem]) -> dict[str, Any]:
    manifests = hashing.canonical_hash([item.manifest for item in items])
    hashes = {item.name: item.content for item in items}
    return {"name": f"shard-{number:06d}.tar", "samples": samples, "manifests": manifests, "sequences": hashes}


def _reject_other_shards(root: Path, plan: list[dict[str, Any]]) -> None:
    wanted = {facts["name"]: facts for facts in plan}
    refuse_foreign_file(root / INDEX, INDEX_MARKS)
    for name in wanted:
        refuse_foreign_file((root / name).with_suffix(".json"), SHARD_MARKS)
    for path in sorted(root.glob("shard-*.tar")):
        # A tar without .json is what an interrupted run leaves.
        beside = path.with_suffix(".json")
        facts = wanted.get(path.name)
        if facts is None or (beside.is_file() and not facts.items() <= tables.read_json(beside).items()):
            raise InputError(
                file=path, got="a shard of another export", expected="one of this dataset, size and kind, or none",
                remedy="choose another --out, or delete that folder",
            )  # fmt: skip


def _complete_shard(root: Path, facts: dict[str, Any]) -> dict[str, Any] | None:
    path = root / facts["name"]
    if not path.is_file() or not path.with_suffix(".json").is_file():
        return None
    there = tables.read_json(path.with_suffix(".json"))
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return there if digest == there.get("sha256") else None


def _write_shard(root: Path, facts: dict[str, Any], items: list[SequenceItem]) -> dict[str, Any]:
    path = root / facts["name"]
    # The .json stands for a whole tar.
    path.with_suffix(".json").unlink(missing_ok=True)
    with new_file(path) as beside:
        _tar(beside, (member for item in items for member in tar_members(item, facts["samples"])))
        with beside.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
    done = {**facts, "bytes": path.stat().st_size, "sha256": digest}
    write_file(path.with_suffix(".json"), tables.json_document(done))
    return done


def _tar(path: Path, members: Iterable[Member]) -> None:
    with tarfile.open(path, "w", format=tarfile.GNU_FORMAT) as tar:
        for name, _, read in members:
            body = read()
            info = tarfile.TarInfo(name)
            info.size = len(body)
            tar.addfile(info, io.BytesIO(body))
