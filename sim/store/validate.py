"""Checks a stored sequence, dataset or run of a tracker, and returns the problems as a list of errors.

Every file must have the hash in manifest.json or run.json. Files that these do not name, and what interrupted runs left
over, are problems, too.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from scenarios.errors import FlockscopeError, InputError
from sim import hashing
from sim.store import packs, seal
from sim.store.atomic import PARTIAL
from sim.store.group_files import read_never_arrives, stands_in, warn_of
from sim.store.own_files import is_side_file, split_and_name
from sim.store.seal import is_run, read_run, run_problems
from sim.store.track_files import read_run as read_run_tracks


def validate(folder: str | Path) -> list[FlockscopeError]:
    """Returns the problems of a generated sequence or dataset, or of tracks, as errors that are not raised.

    Args:
        folder: A sequence, a run, or a folder of some.

    Returns:
        Leftovers of interrupted runs, then faults of each sequence and run, sorted by path; [] if all is well. If files
        are damaged, nothing else is reported for their sequence or run. Warnings tell of people who stood still.

    Raises:
        InputError: There is nothing to check.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise _problem(folder, "no folder", "a generated dataset, a sequence, or tracks", "check the path")
    if seal.is_sequence(folder) or is_run(folder):
        return list(_faults(folder))
    every, tars = (
        [*_inside(folder, seal.is_sequence), *_inside(folder, is_run)],
        sorted(filter(packs.is_named_as_shard, folder.glob("**/*.tar"))),
    )
    partial = sorted(folder.glob(f"**/{PARTIAL}*"))
    found = [_problem(path, "left by an interrupted run", "no such file or folder") for path in partial]
    if not every and not found and not tars:
        raise _problem(folder, "no sequences", "a generated dataset, or tracks", "check the path")
    packed = [fault for tar in tars if PARTIAL not in str(tar) for fault in _shard_faults(tar)]
    return [*found, *(fault for each in every for fault in _faults(each)), *packed]


def _inside(root: Path, kind: Callable[[Path], bool]) -> list[Path]:
    return sorted(p for p in (root, *root.glob("**/*/")) if PARTIAL not in str(p.relative_to(root)) and kind(p))


def content_hash(folder: str | Path) -> str:
    """Returns the SHA-256 of a generated dataset or sequence, from the hashes in its manifests."""
    folders, shards = _inside(Path(folder), seal.is_sequence), packs.shards_in(Path(folder))
    if not folders and not shards:
        raise _problem(Path(folder), "no sequences", "a generated sequence or dataset", "give what `generate` made")
    hashes = {split_and_name(p): seal.read_manifest(p)["content_hash"] for p in folders}
    for shard in shards:
        split, rows = shard.absolute().parent.parent.name, packs.rows_of(packs.read_seal(shard))
        hashes |= {f"{split}/{row[0]}": row[-1] for row in rows}
    return hashing.dataset_hash(hashes)


def _problem(path: Path, got: object, expected: object, remedy: str = seal.REDO) -> InputError:
    return InputError(file=path, got=got, expected=expected, remedy=remedy)


def _faults(folder: Path) -> Iterator[FlockscopeError]:
    try:
        if seal.is_sequence(folder):
            manifest = seal.read_manifest(folder)
            damaged = list(seal.damaged_files(folder, manifest["files"]))
            yield from damaged or _other_faults(folder, manifest)
            return
        problems = list(run_problems(folder, read_run(folder)))
        yield from problems
        if not problems:
            read_run_tracks(folder)
    except FlockscopeError as error:
        yield error


def _shard_faults(tar: Path) -> Iterator[FlockscopeError]:
    """Yields the faults of a shard and of the sequences in it, whose files are named as <shard>/<sequence>/<file>."""
    if not packs.is_shard(tar):
        yield _problem(tar, "a shard without a seal", f"{packs.seal_of(tar).name} beside it")
        return
    with tempfile.TemporaryDirectory(prefix="flockscope-") as root:
        try:
            for folder in packs.extract(tar, Path(root)):
                for fault in _faults(folder):
                    yield fault.replaced(file=str(fault.file).replace(str(folder.parent), str(tar)))
        except FlockscopeError as error:
            yield error


def _other_faults(folder: Path, manifest: dict[str, Any]) -> Iterator[InputError]:
    lost = read_never_arrives(folder)
    warn_of("person", [(folder.name, stands_in(folder))])
    named = {seal.MANIFEST, *manifest["files"]}
    for path in sorted(folder.rglob("*")):
        inside = path.relative_to(folder)
        if path.is_file() and inside.as_posix() not in named and not is_side_file(inside):
            yield _problem(path, "a file the manifest does not name", "only its own", remedy="move it elsewhere")
    for one in lost:
        yield _problem(folder, one.words, "groups that reach their goals", "open the way, or move the goal")
