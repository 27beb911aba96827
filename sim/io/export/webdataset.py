"""Tar shards for streaming, as the library webdataset reads them: the files of a sample stand together under one key.

A sample is a whole sequence, with every file it has and so its content hash, or one frame with its labels. The same
dataset gives the same bytes: order by name, no times, no owners. A shard is whole or not there, with a .json beside it
that says what it holds; index.json, written last, names all.
"""

from __future__ import annotations

import hashlib
import io
import re
import tarfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

from scenarios.errors import InputError
from sim import hashing
from sim.io.export.frame_labels import labels
from sim.io.files import tables
from sim.io.files.atomic import new_file, remove_partials, write_file
from sim.io.files.lock import lock_folder
from sim.io.pictures.stored_pictures import StoredPictures
from sim.io.source import sequence_folders, split_and_name
from sim.io.store.manifest import MANIFEST, read_manifest
from sim.io.store.streams import file_name

SAMPLES = ("sequence", "frame")
UNITS = {"": 1, "k": 10**3, "M": 10**6, "G": 10**9}
INDEX = "index.json"
HEADER = 1024  # bytes of a member in a tar, beside its own, about
FRAMED = ("left", "right", "disparity", "ids")
"""Streams with one picture per frame."""

Member = tuple[str, Callable[[], bytes]]
Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class Item:
    """A stored sequence to pack: its folder, bytes in a shard, content hash, manifest's hash, pictures' kind."""

    folder: Path
    bytes: int
    content: str
    manifest: str
    images: str | None

    @property
    def name(self) -> str:
        """<split>/<name>."""
        return split_and_name(self.folder)

    @property
    def key(self) -> str:
        """Its name in a shard: webdataset ends a key at its first dot, so those of a name are written %2E."""
        return self.name.replace(".", "%2E")


def webdataset(
    source: str | Path,
    out: str | Path,
    *,
    shard_size: int = 10**9,
    samples: str = "sequence",
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Pack a dataset of ours into OUT/shard-000000.tar, …; the index. Sequences are never cut in two.

    shard_size: bytes that a shard shall not exceed, unless one sequence does; samples: "sequence" or "frame". Shards
    that are there whole are kept. progress(done, all, name) is called after each. InputError where OUT holds another
    dataset's, or the source is not ours, or of videos where frames are wanted.
    """
    items, root = _items(Path(source), samples), Path(out)
    shards = list(_shards(items, shard_size))
    with lock_folder(root):
        remove_partials(root)
        plan = [_facts(samples, number, some) for number, some in enumerate(shards)]
        _refuse_others(root, plan)
        for number, (facts, some) in enumerate(zip(plan, shards, strict=True), 1):
            plan[number - 1] = _kept(root, facts) or _written(root, facts, some)
            if progress is not None:
                progress(number, len(plan), facts["name"])
        hashes = {name: value for facts in plan for name, value in facts["sequences"].items()}
        index = {"format": tables.FORMAT, "samples": samples, "content_hash": hashing.dataset_hash(hashes)}
        index["shards"] = plan
        write_file(root / INDEX, tables.json_document(index))
    return index


def size_of(text: str) -> int:
    """Bytes of `500MB`, `1.5 GB`, `20000000`."""
    found = re.fullmatch(r"(\d{1,12}(?:\.\d{1,6})?)\s*(?:([kMG])?B)?", text.strip())
    size = 0 if found is None else round(float(found[1]) * UNITS[found[2] or ""])
    if size < 1:
        raise InputError(
            place="--shard-size", got=repr(text), expected="bytes, kB, MB or GB above 0", remedy="write 500MB"
        )
    return size


def _items(source: Path, samples: str) -> list[Item]:
    """What to pack, in the order of names."""
    found = sorted(map(_item, sequence_folders(source, "generated")), key=lambda item: item.name)
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


def _item(folder: Path) -> Item:
    manifest = read_manifest(folder)
    size = sum(HEADER + facts["bytes"] for facts in manifest["files"].values())
    return Item(folder, size, manifest["content_hash"], manifest["sha256"], manifest.get("images"))


def _shards(items: list[Item], size: int) -> Iterator[list[Item]]:
    some: list[Item] = []
    full = 0
    for item in items:
        if some and full + item.bytes > size:
            yield some
            some, full = [], 0
        some.append(item)
        full += item.bytes
    yield some


def _facts(samples: str, number: int, items: list[Item]) -> dict[str, Any]:
    """What is known of a shard before it is written."""
    manifests = hashing.canonical_hash([item.manifest for item in items])
    hashes = {item.name: item.content for item in items}
    return {"name": f"shard-{number:06d}.tar", "samples": samples, "manifests": manifests, "sequences": hashes}


def _refuse_others(root: Path, plan: list[dict[str, Any]]) -> None:
    """InputError where a shard stands that is none of these."""
    wanted = {facts["name"]: facts for facts in plan}
    for path in sorted(root.glob("shard-*.tar")):
        beside = path.with_suffix(".json")
        facts = wanted.get(path.name)
        if facts is None or (beside.is_file() and not facts.items() <= tables.read_json(beside).items()):
            raise InputError(
                file=path, got="a shard of another export", expected="one of this dataset, size and kind, or none",
                remedy="choose another --out, or delete that folder",
            )  # fmt: skip


def _kept(root: Path, facts: dict[str, Any]) -> dict[str, Any] | None:
    """What is known of a shard that is there whole."""
    path = root / facts["name"]
    if not path.is_file() or not path.with_suffix(".json").is_file():
        return None
    there = tables.read_json(path.with_suffix(".json"))
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return there if digest == there.get("sha256") else None


def _written(root: Path, facts: dict[str, Any], items: list[Item]) -> dict[str, Any]:
    path = root / facts["name"]
    path.with_suffix(".json").unlink(missing_ok=True)
    with new_file(path) as beside:
        _tar(beside, (member for item in items for member in _members(item, facts["samples"])))
        with beside.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
    done = {**facts, "bytes": path.stat().st_size, "sha256": digest}
    write_file(path.with_suffix(".json"), tables.json_document(done))
    return done


def _tar(path: Path, members: Iterable[Member]) -> None:
    with tarfile.open(path, "w", format=tarfile.GNU_FORMAT) as tar:
        for name, read in members:
            body = read()
            info = tarfile.TarInfo(name)
            info.size = len(body)
            tar.addfile(info, io.BytesIO(body))


def _members(item: Item, samples: str) -> Iterator[Member]:
    """The files of a sequence's samples, in order; InputError where one has been altered."""
    manifest = read_manifest(item.folder)
    stored = StoredPictures(item.folder, manifest)
    if samples == "sequence":
        yield f"{item.key}.{MANIFEST}", (item.folder / MANIFEST).read_bytes
        for name in manifest["files"]:
            yield f"{item.key}.{name.replace('/', '.')}", partial(stored.body, name)
        return
    there = [stream for stream in stored.streams if stream in FRAMED]
    for index, body in enumerate(labels(item.folder, manifest), 1):
        yield f"{item.key}/{index:06d}.json", partial(bytes, body)
        for stream in there:
            name = file_name(stream, stored.images, index)
            yield f"{item.key}/{index:06d}.{stream}{Path(name).suffix}", partial(stored.body, name)
