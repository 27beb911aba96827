"""WebDataset export: packs stored sequences into tar shards that the library webdataset streams.

A sample is a whole sequence: all its files, hence its content hash. They share a key and stand next to each other. The
same dataset gives the same bytes: members are sorted by sequence and have no times or owners. A shard appears complete
or not at all, with a .json beside it that describes it. index.json, written last, lists all shards.
"""

from __future__ import annotations

import io
import re
import tarfile
from collections.abc import Callable, Iterator
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
from sim.io.store.seal import MANIFEST, read_manifest

BLOCK = 512  # bytes: a tar holds whole blocks
UNITS = {"": 1, "k": 10**3, "M": 10**6, "G": 10**9}
INDEX = "index.json"
INDEX_MARKS: Marks = {"content_hash": str, "shards": list}
SHARD_MARKS: Marks = {"manifests": str, "sequences": dict}  # what every index.json, and every .json of a shard, has

Progress = Callable[[int, int, str], None]
Packed = tuple[Path, str, str]  # the folder of a sequence, the hash of its manifest, and that of its content


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
    root, shards, done = Path(out), _shards(Path(source), shard_size), list[dict[str, Any]]()
    plan = [_facts(number, some) for number, some in enumerate(shards)]
    with lock_folder(root):
        remove_partials(root)
        _reject_other_shards(root, plan)
        for facts, some in zip(plan, shards, strict=True):
            done.append(_complete_shard(root, facts) or _write_shard(root, facts, some))
            if progress is not None:
                progress(len(done), len(plan), facts["name"])
        hashes = {name: value for facts in plan for name, value in facts["sequences"].items()}
        index = {"format": tables.FORMAT, "content_hash": hashing.dataset_hash(hashes), "shards": done}
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


def _shards(source: Path, size: int) -> list[list[Packed]]:
    """Returns the consecutive sequences of each shard, as many as fit into a tar of `size` bytes, at least one."""
    folders = sorted(sequence_folders(source, "generated"), key=split_and_name)
    twice = next((a for a, b in pairwise(map(split_and_name, folders)) if a == b), None)
    if twice is not None:
        raise InputError(file=source, got=f"two sequences {twice}", expected="unique names", remedy="export them apart")
    shards: list[list[Packed]] = []
    full = size
    for folder in folders:
        manifest = read_manifest(folder)  # not kept: those of a large dataset would fill the memory
        bytes_of = {name: facts["bytes"] for name, facts in manifest["files"].items()}
        bytes_of[MANIFEST] = (folder / MANIFEST).stat().st_size
        more = 0
        for name, count in bytes_of.items():
            # A header before each file, and two more blocks with its name if that is long.
            long = len(f"{_key(folder)}.{name}".encode()) > tarfile.LENGTH_NAME
            more += BLOCK * ((3 if long else 1) + -(-count // BLOCK))
        if full + more > size:
            shards.append([])
            full = 2 * BLOCK + tarfile.RECORDSIZE  # the end of a tar, at most
        shards[-1].append((folder, manifest["sha256"], manifest["content_hash"]))
        full += more
    return shards


def _key(folder: Path) -> str:
    return split_and_name(folder).replace(".", "%2E")  # webdataset ends a key at its first dot


def _facts(number: int, some: list[Packed]) -> dict[str, Any]:
    manifests = hashing.canonical_hash([sha256 for _, sha256, _ in some])
    hashes = {split_and_name(folder): content for folder, _, content in some}
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
            got, remedy = "a shard of another export", "choose another --out, or delete that folder"
            raise InputError(file=path, got=got, expected="one of this dataset, size and kind, or none", remedy=remedy)


def _complete_shard(root: Path, facts: dict[str, Any]) -> dict[str, Any] | None:
    path = root / facts["name"]
    if not path.is_file() or not path.with_suffix(".json").is_file():
        return None
    there = tables.read_json(path.with_suffix(".json"))
    return there if hashing.file_hash(path) == there.get("sha256") else None


def _write_shard(root: Path, facts: dict[str, Any], some: list[Packed]) -> dict[str, Any]:
    path = root / facts["name"]
    # The .json stands for a whole tar.
    path.with_suffix(".json").unlink(missing_ok=True)
    with new_file(path) as beside:
        with tarfile.open(beside, "w", format=tarfile.GNU_FORMAT) as tar:
            for name, body in (member for folder, *_ in some for member in _members(folder)):
                info = tarfile.TarInfo(name)
                info.size = len(body)
                tar.addfile(info, io.BytesIO(body))
        digest = hashing.file_hash(beside)
    done = {**facts, "bytes": path.stat().st_size, "sha256": digest}
    write_file(path.with_suffix(".json"), tables.json_document(done))
    return done


def _members(folder: Path) -> Iterator[tuple[str, bytes]]:
    """Yields name and content of each file of a sequence as it stands in the tar, the manifest first."""
    stored = StoredPictures(folder, read_manifest(folder))
    yield f"{_key(folder)}.{MANIFEST}", (folder / MANIFEST).read_bytes()
    for name in stored.manifest["files"]:
        yield f"{_key(folder)}.{name.replace('/', '.')}", stored.body(name)
