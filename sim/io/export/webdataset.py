"""WebDataset export: packs stored sequences into tar shards that the library webdataset streams.

A sample is a whole sequence: all its files, hence its content hash. They share a key and stand next to each other. The
same dataset gives the same bytes: members are sorted by sequence and have no times or owners. A shard appears complete
or not at all, with a .json beside it that describes it. index.json, written last, lists all shards.
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
from sim.io.files import tables
from sim.io.files.atomic import lock_folder, new_file, remove_partials, write_file
from sim.io.files.own_files import Marks, refuse_foreign_file
from sim.io.pictures.stored_pictures import StoredPictures
from sim.io.source import sequence_folders, split_and_name
from sim.io.store.seal import MANIFEST, read_whole_manifest

BLOCK = 512  # bytes: a tar holds whole blocks

# name of a file in the tar, its size in bytes, and a call that reads its content
Member = tuple[str, int, Callable[[], bytes]]


@dataclass(frozen=True)
class SequenceItem:
    """A stored sequence to pack."""

    folder: Path  # where it is stored
    manifest: dict[str, Any]  # the content of its manifest.json

    @property
    def name(self) -> str:
        """The name <split>/<sequence>."""
        return split_and_name(self.folder)

    def members(self) -> Iterator[Member]:
        """Yields the members of the tar: all files, the manifest first."""
        key = self.name.replace(".", "%2E")  # webdataset ends a key at its first dot
        stored, path = StoredPictures(self.folder, self.manifest), self.folder / MANIFEST
        yield f"{key}.{MANIFEST}", path.stat().st_size, path.read_bytes
        for name, facts in self.manifest["files"].items():
            yield f"{key}.{name.replace('/', '.')}", facts["bytes"], partial(stored.body, name)

    def tar_bytes(self) -> int:
        """Returns how many bytes the members add to a tar."""
        total = 0
        for name, size, _ in self.members():
            letters = len(name.encode())
            # A name of more than 100 bytes is a member of its own.
            total += BLOCK + _whole(letters + 1) if letters > tarfile.LENGTH_NAME else 0
            total += BLOCK + _whole(size)
        return total


def _whole(size: int) -> int:
    return -(-size // BLOCK) * BLOCK


UNITS = {"": 1, "k": 10**3, "M": 10**6, "G": 10**9}
RECORD = tarfile.RECORDSIZE
INDEX = "index.json"
INDEX_MARKS: Marks = {"content_hash": str, "shards": list}
SHARD_MARKS: Marks = {"manifests": str, "sequences": dict}  # what every index.json, and every .json of a shard, has

Progress = Callable[[int, int, str], None]


def webdataset(
    source: str | Path, out: str | Path, *, shard_size: int = 10**9, progress: Progress | None = None
) -> dict[str, Any]:
    """Packs a generated dataset into OUT/shard-000000.tar, …, and writes OUT/index.json.

    Args:
        source: A generated sequence or dataset.
        out: The folder. Complete shards of an earlier run are kept.
        shard_size: Bytes that a shard may have. A sequence is never divided, so a shard of one sequence may be larger.
        progress: Called as progress(shards done, shards in all, name of the last one) after each shard.

    Returns:
        The index: format, content_hash, and shards, the content of the .json beside each shard.
    """
    root, shards = Path(out), list(_shards(_items(Path(source)), shard_size))
    with lock_folder(root):
        remove_partials(root)
        plan = [_facts(number, some) for number, some in enumerate(shards)]
        _reject_other_shards(root, plan)
        for number, (facts, some) in enumerate(zip(plan, shards, strict=True), 1):
            plan[number - 1] = _complete_shard(root, facts) or _write_shard(root, facts, some)
            if progress is not None:
                progress(number, len(plan), facts["name"])
        hashes = {name: value for facts in plan for name, value in facts["sequences"].items()}
        index = {"format": tables.FORMAT, "content_hash": hashing.dataset_hash(hashes), "shards": plan}
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


def _items(source: Path) -> list[SequenceItem]:
    folders = sequence_folders(source, "generated")
    found = sorted((SequenceItem(p, read_whole_manifest(p)) for p in folders), key=lambda item: item.name)
    twice = next((a.name for a, b in pairwise(found) if a.name == b.name), None)
    if twice is not None:
        raise InputError(file=source, got=f"two sequences {twice}", expected="unique names", remedy="export them apart")
    return found


def _shards(items: list[SequenceItem], size: int) -> Iterator[list[SequenceItem]]:
    """Yields the consecutive sequences of each shard, as many as fit into a tar of `size` bytes, at least one."""
    some: list[SequenceItem] = []
    full = 0
    for item in items:
        more = item.tar_bytes()
        if some and -(-(full + more + 2 * BLOCK) // RECORD) * RECORD > size:  # a tar ends with two empty blocks
            yield some
            some, full = [], 0
        some.append(item)
        full += more
    yield some


def _facts(number: int, items: list[SequenceItem]) -> dict[str, Any]:
    manifests = hashing.canonical_hash([item.manifest["sha256"] for item in items])
    hashes = {item.name: item.manifest["content_hash"] for item in items}
    return {"name": f"shard-{number:06d}.tar", "manifests": manifests, "sequences": hashes}


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
        _tar(beside, (member for item in items for member in item.members()))
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
