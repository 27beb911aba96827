"""WebDataset export: packs stored sequences into tar shards that the library webdataset streams.

A sample is a whole sequence: all its files, hence its content hash. They share a key and stand next to each other. The
same dataset gives the same bytes: members are sorted by sequence and have no times or owners. index.json lists all
shards. The files appear when all are complete, index.json last.
"""

from __future__ import annotations

import io
import os
import re
import tarfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

from scenarios.errors import InputError, reject
from sim import hashing
from sim.pictures.stored_pictures import StoredPictures
from sim.store import tables
from sim.store.atomic import lock_folder, remove_partials, staged_path, write_file
from sim.store.own_files import is_side_file, split_and_name
from sim.store.seal import MANIFEST, read_whole_manifest
from tracking.recordings.source import generated_folders

BLOCK = 512  # bytes: a tar holds whole blocks
END = 2 * BLOCK + tarfile.RECORDSIZE  # bytes at the end of a tar, at most
UNITS = {"": 1, "k": 10**3, "M": 10**6, "G": 10**9}
INDEX, SHARD = "index.json", r"shard-[0-9]{6,}\.tar"

Progress = Callable[[int, int, str], None]


def webdataset(
    source: str | Path, out: str | Path, *, shard_size: int = 10**9, progress: Progress | None = None
) -> dict[str, Any]:
    """Packs a generated dataset into OUT/shard-000000.tar, …, and writes OUT/index.json.

    Args:
        source: A generated sequence or dataset.
        out: The folder; it must be missing, empty, or hold the same export.
        shard_size: Bytes that a shard may have. A sequence is never divided, so a shard of one sequence may be larger.
        progress: Called as progress(shards done, shards in all, name of the last one) after each shard.

    Returns:
        The index: format, content_hash, and of each shard name, sequences (content hashes by name), bytes and sha256.
    """
    root, shards = Path(out), _shards(Path(source), shard_size)
    hashes = {split_and_name(p): content for some in shards for p, content in some.items()}
    head = {"format": tables.FORMAT, "content_hash": hashing.dataset_hash(hashes)}
    with new_shards(root, head, [shard_name(number) for number in range(len(shards))]) as (partial, done):
        for number, some in enumerate(shards):
            done.append(_write_shard(partial / shard_name(number), some))
            if progress is not None:
                progress(len(done), len(shards), done[-1]["name"])
    return {**head, "shards": done}


@contextmanager
def new_shards(
    root: Path, head: dict[str, Any], names: list[str] | None = None
) -> Iterator[tuple[Path, list[dict[str, Any]]]]:
    """Yields a temporary folder for the block to write shards to, and a list for the facts of each in index.json.

    When the block ends the shards become files of `root`, and index.json is written, which has `head` and the facts.
    names: of the shards; None if they are only known at the end. Raises InputError if `root` holds anything but an
    export with the same head and names.
    """
    with lock_folder(root):
        remove_partials(root)
        _reject_others(root, head, names)
        # Inside the folder, which may be a link, a mount or the current one.
        with staged_path(root / INDEX) as partial:
            partial.mkdir()
            done: list[dict[str, Any]] = []
            yield partial, done
            (root / INDEX).unlink(missing_ok=True)
            for facts in done:
                os.replace(partial / facts["name"], root / facts["name"])
            write_file(root / INDEX, tables.json_document({**head, "shards": done}))


def shard_name(number: int) -> str:
    """Returns the file name of a shard, by its number from 0."""
    return f"shard-{number:06d}.tar"


def _reject_others(root: Path, head: dict[str, Any], names: list[str] | None) -> None:
    found = {path.name for path in root.iterdir() if not is_side_file(path.name)}
    stored = tables.read_json(root / INDEX) if INDEX in found else {}
    others = found - {INDEX}
    fits = others == set(names) if names is not None else all(re.fullmatch(SHARD, name) for name in others)
    # the index of whole sequences has no key "sample"
    if found and not (fits and all(stored.get(key) == head.get(key) for key in ("sample", *head))):
        got, remedy = "other files, or another export", "choose another --out, or delete that folder"
        raise InputError(file=root, got=got, expected="this dataset in shards of this size, or nothing", remedy=remedy)


def size_of(text: str) -> int:
    """Returns the number of bytes that a text such as `500MB`, `1.5 GB` or `3 kB` means; units are powers of 1000."""
    found = re.fullmatch(r"([0-9]{1,12}(?:\.[0-9]{1,6})?)\s*(?:([kMG])?B)?", text.strip())
    size = 0 if found is None else round(float(found[1]) * UNITS[found[2] or ""])
    reject(size < 1, "", repr(text), "bytes, kB, MB or GB above 0", "write 500MB", "--shard-size")
    return size


def _shards(source: Path, size: int) -> list[dict[Path, str]]:
    """Returns the content hash of each sequence folder of each shard, as many as fit into a tar of `size` bytes."""
    folders = sorted(generated_folders(source), key=split_and_name)
    twice = next((a for a, b in pairwise(map(split_and_name, folders)) if a == b), None)
    reject(twice is not None, source, f"two sequences {twice}", "unique names", "export them apart")
    shards: list[dict[Path, str]] = []
    full = size
    for folder in folders:
        manifest = read_whole_manifest(folder)  # not kept: those of a large dataset would fill the memory
        sizes = {MANIFEST: (folder / MANIFEST).stat().st_size}
        sizes |= {name: facts["bytes"] for name, facts in manifest["files"].items()}
        more = sum(member_bytes(f"{key_of(folder)}.{name}", count) for name, count in sizes.items())
        if full + more > size:
            shards.append({})
            full = END
        shards[-1][folder] = manifest["content_hash"]
        full += more
    return shards


def member_bytes(name: str, size: int) -> int:
    """Returns the bytes that a file of `size` bytes takes in a tar."""
    # A header before each file, and two more blocks with its name if that is long.
    long = len(name.encode()) > tarfile.LENGTH_NAME
    return BLOCK * (1 + 2 * long + -(-size // BLOCK))


def key_of(folder: Path) -> str:
    """Returns the key of a sequence folder: <split>/<name>, with dots as %2E."""
    return split_and_name(folder).replace(".", "%2E")  # webdataset ends a key at its first dot


def _write_shard(path: Path, some: dict[Path, str]) -> dict[str, Any]:
    with tarfile.open(path, "w", format=tarfile.GNU_FORMAT) as tar:
        for name, body in (member for folder in some for member in _members(folder)):
            add_member(tar, name, body)
    sequences = {split_and_name(folder): content for folder, content in some.items()}
    return {"name": path.name, "sequences": sequences, **file_facts(path)}


def add_member(tar: tarfile.TarFile, name: str, body: bytes) -> None:
    """Adds a file to a tar, without time or owner."""
    info = tarfile.TarInfo(name)
    info.size = len(body)
    tar.addfile(info, io.BytesIO(body))


def file_facts(path: Path) -> dict[str, Any]:
    """Returns size and hash of a shard as in index.json."""
    return {"bytes": path.stat().st_size, "sha256": hashing.file_hash(path)}


def _members(folder: Path) -> Iterator[tuple[str, bytes]]:
    """Yields name and content of each file of a sequence as it stands in the tar, the manifest first."""
    stored = StoredPictures(folder, read_whole_manifest(folder))
    yield f"{key_of(folder)}.{MANIFEST}", (folder / MANIFEST).read_bytes()
    for name in stored.manifest["files"]:
        yield f"{key_of(folder)}.{name.replace('/', '.')}", stored.check(name, whole=True)
