"""Checks a stored sequence, dataset or run of a tracker, and returns the problems as a list of errors.

Every file must have the hash in manifest.json or run.json and be readable; truth, detections and pictures must have
the hashes of the manifest. Files that interrupted runs left over are problems, too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from scenarios.errors import FlockscopeError, InputError
from sim import hashing
from sim.io.files.atomic import PARTIAL
from sim.io.files.own_files import is_side_file
from sim.io.pictures.stored_pictures import StoredPictures
from sim.io.source import generated_folders, split_and_name
from sim.io.store import seal, truth_files
from sim.io.store.seal import is_run, read_run, run_problems
from sim.io.store.track_files import read_tracks
from sim.streams import suffix
from sim.types import BACKGROUNDS


def validate(folder: str | Path) -> list[FlockscopeError]:
    """Returns the problems of a generated sequence or dataset, or of tracks, as errors that are not raised.

    Args:
        folder: A sequence, a run, or a folder of some.

    Returns:
        Leftovers of interrupted runs, faults of seqmaps/, then faults of each sequence and run, sorted by path; [] if
        all is well. If files are damaged, nothing else is reported for their sequence or run.

    Raises:
        InputError: There is nothing to check.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise _problem(folder, "no folder", "a generated dataset, a sequence, or tracks", "check the path")
    if seal.is_sequence(folder):
        return _sequence(folder)
    if is_run(folder):
        return _run(folder)
    sequences, runs = _inside(folder, seal.is_sequence), _inside(folder, is_run)
    partial = sorted(folder.glob(f"**/{PARTIAL}*"))
    found = [_problem(path, "left by an interrupted run", "no such file or folder") for path in partial]
    found += _seqmaps(folder) if sequences or not runs else ()
    if not sequences and not runs and not found:
        raise _problem(folder, "no sequences", "a generated dataset, or tracks", "check the path")
    checks = [*map(_sequence, sequences), *map(_run, runs)]
    return found + [problem for problems in checks for problem in problems]


def _inside(root: Path, kind: Callable[[Path], bool]) -> list[Path]:
    return sorted(p for p in (root, *root.glob("**/*/")) if PARTIAL not in str(p.relative_to(root)) and kind(p))


def content_hash(folder: str | Path) -> str:
    """Returns the SHA-256 of a generated dataset or sequence, from the hashes in its manifests."""
    folders = generated_folders(Path(folder))
    return hashing.dataset_hash({split_and_name(p): seal.read_manifest(p)["content_hash"] for p in folders})


def _problem(path: Path, got: object, expected: object, remedy: str = seal.REDO) -> InputError:
    return InputError(file=path, got=got, expected=expected, remedy=remedy)


def _seqmaps(root: Path) -> Iterator[InputError]:
    base = root if (root / "seqmaps").is_dir() or any(root.glob("flockscope-*")) else root.parent
    for split in sorted(root.glob("flockscope-*")) if base == root else [root]:
        path = base / "seqmaps" / f"{split.name}.txt"
        if not path.is_file():
            if any(split.glob("*/")):
                yield _problem(path, "missing", "the list of the split's sequences")
            continue
        listed = set(path.read_text(encoding="utf-8").splitlines()[1:])
        folders = {p.name for p in split.iterdir() if p.is_dir()}
        there = {name for name in folders if not (name.startswith(PARTIAL) or is_side_file(name))}
        for name in sorted(listed ^ there):
            yield _problem(path, f"{'a' if name in listed else 'no'} line {name}", "those of the split's folders")


def _sequence(folder: Path) -> list[FlockscopeError]:
    try:
        manifest = seal.read_manifest(folder)
        problems: list[FlockscopeError] = list(seal.damaged_files(folder, manifest["files"]))
        return problems or [*_extra(folder, manifest), *_content(folder, manifest)]
    except FlockscopeError as error:
        return [error]


def _run(folder: Path) -> list[FlockscopeError]:
    try:
        run = read_run(folder)
        problems: list[FlockscopeError] = list(run_problems(folder, run))
        if not problems:
            read_tracks(folder)
        return problems
    except FlockscopeError as error:
        return [error]


def _extra(folder: Path, manifest: dict[str, Any]) -> Iterator[InputError]:
    named = {seal.MANIFEST, *manifest["files"]}
    for path in sorted(folder.rglob("*")):
        inside = path.relative_to(folder)
        if path.is_file() and inside.as_posix() not in named and not is_side_file(inside):
            yield _problem(path, "a file the manifest does not name", "only its own", remedy="move it elsewhere")


def _content(folder: Path, manifest: dict[str, Any]) -> Iterator[FlockscopeError]:
    text = (folder / "scenario.toml").read_text(encoding="utf-8")
    has, exact = manifest["files"], folder / "det" / "det.parquet"
    truth = truth_files.read_truth(folder) if "gt/truth.parquet" in has else None
    detections = truth_files.read_detections(exact) if "det/det.parquet" in has else []
    name = hashing.truth_hash(text, manifest["seed"], manifest["repeat"], truth)
    if name != manifest["truth_hash"]:
        yield _problem(folder / seal.MANIFEST, "another truth_hash", name)
    if hashing.content_hash(name, detections, manifest.get("pixels")) != manifest["content_hash"]:
        yield _problem(folder / seal.MANIFEST, "another content_hash", "that of the stored content")
    stored = StoredPictures(folder, manifest)
    for stream in stored.streams:
        count = BACKGROUNDS if stream == "background" else manifest["sequence"]["length"]
        digest = hashing.PixelHash()
        try:
            for picture in stored.all(stream, count):
                digest.add(picture)
        except FlockscopeError as error:
            yield error
            continue
        if suffix(stream, stored.images) == "png" and digest.hex() != manifest["pixels"].get(stream):
            yield _problem(folder / seal.MANIFEST, f"other pixels of {stream}", "the pictures of their hash")
