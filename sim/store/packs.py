"""Packed sequences: a shard holds those of up to 100 seeds of one entry, so that a large dataset has few files.

A shard <entry>-s<first seed of its hundred>.tar holds whole sequence folders, <name>/<file>, by seed, without times and
owners: `tar xf` gives the folders that `generate` writes without --pack. <entry>-s<…>.parquet beside it is its seal,
written last: a row for each sequence, and as metadata the hash of the tar. index.parquet of a split has all rows.

Readers unpack a shard into a temporary folder, which is deleted when the process ends.
"""

from __future__ import annotations

import re
import shutil
import tarfile
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from multiprocessing.util import Finalize
from pathlib import Path
from typing import Any

from scenarios.errors import InputError, reject
from sim.store.atomic import staged_path, write_file
from sim.store.own_files import file_name, is_ours
from sim.store.seal import SHARDS, check_file, file_facts, read_manifest
from sim.store.tables import StoredTable, read_table, table_bytes

SEEDS = 100  # of a shard
INDEX = "index.parquet"
# name; seed; split; shard: its file below the split; offset, bytes: of the sequence in the tar; frames; people: number
# of different ones; hash: content_hash
COLUMNS = ("name", "seed", "split", "shard", "offset", "bytes", "frames", "people", "hash")
UNITS = {"offset": "bytes", "bytes": "bytes"}
Row = tuple[Any, ...]


def seal_of(shard: Path) -> Path:
    """Returns the path of a shard's seal."""
    return shard.with_suffix(".parquet")


def shards_in(folder: Path) -> list[Path]:
    """Returns the shards in a folder or at most 2 levels below it, sorted."""
    found = (path for below in ("", "*/", "*/*/") for path in folder.glob(below + SHARDS))
    return sorted(filter(is_shard, found))


def is_shard(path: Path) -> bool:
    """Returns True if the path is a shard: a tar with a seal beside it that flockscope wrote."""
    return path.suffix == ".tar" and path.is_file() and bool(is_ours(seal_of(path)))


def is_named_as_shard(path: Path) -> bool:
    """Returns True if the path has the name of a shard, whether or not a seal is beside it."""
    return re.fullmatch(re.escape(path.parent.name) + r"-s\d{5,}\.tar", path.name) is not None


def read_seal(shard: Path) -> StoredTable:
    """Returns the seal of a shard; the shard itself is not read."""
    return read_table(seal_of(shard))


class ShardWriter:
    """Collects sequences in a tar. State: the open tar, and the rows of the sequences that are in it."""

    def __init__(self, tar: tarfile.TarFile, shard: str, split: str) -> None:
        self.tar, self.shard, self.split = tar, shard, split
        self.rows: list[Row] = []

    def add(self, folder: Path) -> None:
        """Adds a stored sequence; its folder can be deleted then."""
        manifest, first = read_manifest(folder), self.tar.offset
        for path in sorted(path for path in folder.rglob("*") if path.is_file()):
            info = tarfile.TarInfo(f"{folder.name}/{path.relative_to(folder).as_posix()}")
            info.size = path.stat().st_size
            with path.open("rb") as file:
                self.tar.addfile(info, file)
        truth = folder / "gt" / "truth.parquet"
        people = len(set(read_table(truth).ints("id").tolist())) if truth.exists() else 0
        frames, seed, span = manifest["sequence"]["length"], manifest["seed"], self.tar.offset - first
        row = (folder.name, seed, self.split, self.shard, first, span, frames, people, manifest["content_hash"])
        self.rows.append(row)


@contextmanager
def new_shard(path: Path, split: str, facts: dict[str, Any]) -> Iterator[tuple[ShardWriter, Path]]:
    """Yields a writer of the shard `path`, and a temporary folder for its sequences; the shard appears at the end.

    facts: what its seal states, beside rows and hash.
    """
    shard = f"{path.parent.name}/{path.name}"
    with staged_path(path) as partial:
        partial.mkdir()
        with tarfile.open(partial / path.name, "w", format=tarfile.GNU_FORMAT) as tar:
            writer = ShardWriter(tar, shard, split)
            yield writer, partial
        stated = facts | file_facts({path.name: partial / path.name})[path.name]
        seal_of(path).unlink(missing_ok=True)
        (partial / path.name).replace(path)
        write_file(seal_of(path), _table(writer.rows, stated))


def _table(rows: Iterable[Row], facts: dict[str, Any]) -> bytes:
    import pyarrow as pa

    columns = list(zip(*rows, strict=True)) or [()] * len(COLUMNS)
    kinds = [pa.string() if name in ("name", "split", "shard", "hash") else pa.int64() for name in COLUMNS]
    arrays = {n: pa.array(c, type=k) for n, c, k in zip(COLUMNS, columns, kinds, strict=True)}
    return table_bytes(arrays, facts, UNITS)


def rows_of(table: StoredTable) -> list[Row]:
    """Returns the rows of a seal or index."""
    return list(zip(*(table.columns[name].tolist() for name in COLUMNS), strict=True))


def write_index(split: Path) -> int:
    """Writes the index of a split from the seals of its shards; returns the number of its sequences."""
    rows = [row for shard in shards_in(split) for row in rows_of(read_seal(shard))]
    write_file(split / INDEX, _table(rows, {}))
    return len(rows)


def check_shard(shard: Path) -> StoredTable:
    """Returns the seal of a shard; raises InputError if the tar is not the one that it names."""
    seal = read_seal(shard)
    check_file(shard, {"bytes": 0, "sha256": ""} | dict(seal.facts), seal_of(shard).name)
    return seal


def extract(shard: Path, root: Path) -> list[Path]:
    """Unpacks a shard into ROOT/<split>; returns the folders of its sequences. Raises InputError if it is damaged."""
    seal, folder = check_shard(shard), root / shard.absolute().parent.parent.name
    folder.mkdir(parents=True, exist_ok=True)
    try:
        with tarfile.open(shard) as tar:
            tar.extractall(folder, filter="data")
    except tarfile.TarError as error:
        expected, remedy = "a tar of sequences", "get it from who made it"
        raise InputError(file=shard, got=str(error), expected=expected, remedy=remedy) from error
    names = [row[0] for row in rows_of(seal)]
    wrong = next((name for name in names if file_name(name) != name), None)
    reject(wrong is not None, seal_of(shard), repr(wrong), "names of sequences", "get it from who made it", "name")
    return [folder / name for name in names]


@cache
def unpacked(shard: Path) -> tuple[Path, ...]:
    """Returns the folders of the sequences of a shard, unpacked; they are deleted when the process ends."""
    root = Path(tempfile.mkdtemp(prefix="flockscope-"))
    Finalize(None, shutil.rmtree, args=(root, True), exitpriority=0)
    return tuple(extract(shard, root))
