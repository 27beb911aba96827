"""Checks a stored sequence, dataset or run of a tracker, and returns the problems as a list of errors.

Every file must have the hash in manifest.json or run.json, be readable, and agree with the other files. Files that
interrupted runs left over are problems, too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import zip_longest
from pathlib import Path
from typing import Any

from scenarios.errors import FlockscopeError, InputError
from sim import hashing
from sim.io.files.atomic import PARTIAL
from sim.io.files.own_files import is_side_file
from sim.io.formats.mot_folder import read_seqinfo
from sim.io.pictures.stored_pictures import StoredPictures
from sim.io.source import sequence_folders, split_and_name
from sim.io.store import manifest as manifests
from sim.io.store import truth_files
from sim.io.store.camera_files import read_scene
from sim.io.store.run_seal import is_run, read_run, run_problems
from sim.io.store.streams import file_name, is_picture, suffix
from sim.io.store.track_files import read_tracks
from sim.types import BACKGROUNDS, Detections, Groups, Truth


def validate(folder: str | Path) -> list[FlockscopeError]:
    """Returns the problems of a generated sequence or dataset, or of tracks, as errors that are not raised.

    Args:
        folder: A sequence, a run, or a folder of some.

    Returns:
        Leftovers of interrupted runs, faults of seqmaps/, then those of each sequence and run, sorted by path. If files
        are damaged, nothing else is reported for their sequence or run.

    Raises:
        InputError: There is nothing to check.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(
            file=folder, got="no folder", expected="a generated dataset, a sequence, or tracks", remedy="check the path"
        )
    if manifests.is_sequence(folder):
        return _sequence(folder)
    if is_run(folder):
        return _run(folder)
    sequences, runs = _inside(folder, manifests.is_sequence), _inside(folder, is_run)
    found = [*_left_behind(folder), *(_seqmaps(folder) if sequences or not runs else ())]
    if not sequences and not runs and not found:
        expected = "a generated dataset, or tracks"
        raise InputError(file=folder, got="no sequences", expected=expected, remedy="check the path")
    checks = [*map(_sequence, sequences), *map(_run, runs)]
    return found + [problem for problems in checks for problem in problems]


def holds_sequences(folder: str | Path) -> bool:
    """Returns True if the folder is or holds a generated sequence, at any depth."""
    return bool(_inside(Path(folder), manifests.is_sequence))


def _inside(root: Path, kind: Callable[[Path], bool]) -> list[Path]:
    return sorted(p for p in (root, *root.glob("**/*/")) if PARTIAL not in str(p.relative_to(root)) and kind(p))


def content_hash(folder: str | Path) -> str:
    """Returns the SHA-256 of a generated dataset or sequence, by its manifests; exports contain the same."""
    found = {
        split_and_name(p): manifests.read_manifest(p)["content_hash"]
        for p in sequence_folders(Path(folder), "generated")
    }
    return hashing.dataset_hash(found)


def _problem(path: Path, got: object, expected: object, place: str = "", remedy: str = manifests.REDO) -> InputError:
    return InputError(file=path, place=place, got=got, expected=expected, remedy=remedy)


def _left_behind(root: Path) -> Iterator[InputError]:
    for path in sorted(root.glob(f"**/{PARTIAL}*")):
        yield _problem(path, "left by an interrupted run", "no such file or folder")


def _seqmaps(root: Path) -> Iterator[InputError]:
    base = root if (root / "seqmaps").is_dir() else root.parent
    for split in sorted(root.glob("flockscope-*")) if base == root else [root]:
        path = base / "seqmaps" / f"{split.name}.txt"
        if not path.is_file():
            if any(split.glob("*/")):
                yield _problem(path, "missing", "the list of the split's sequences")
            continue
        listed = set(path.read_text(encoding="utf-8").splitlines()[1:])
        there = {
            p.name for p in split.iterdir() if p.is_dir() and not (p.name.startswith(PARTIAL) or is_side_file(p.name))
        }
        for name in sorted(listed - there):
            yield _problem(split / name, "missing", f"a sequence, as {path.name} says")
        for name in sorted(there - listed):
            yield _problem(path, f"no line {name}", "every sequence of the split")


def _sequence(folder: Path) -> list[FlockscopeError]:
    try:
        manifest = manifests.read_manifest(folder)
        problems: list[FlockscopeError] = list(manifests.damaged_files(folder, manifest))
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
    named = {manifests.MANIFEST, *manifest["files"]}
    for path in sorted(folder.rglob("*")):
        inside = path.relative_to(folder)
        if path.is_file() and inside.as_posix() not in named and not is_side_file(inside):
            yield _problem(path, "a file the manifest does not name", "only its own", remedy="move it elsewhere")


def _content(folder: Path, manifest: dict[str, Any]) -> Iterator[FlockscopeError]:
    text = (folder / "scenario.toml").read_text(encoding="utf-8")
    if hashing.scenario_hash(text) != manifest["scenario_hash"]:
        yield _problem(folder / "scenario.toml", "another scenario", "the one of scenario_hash")
    length = manifest["sequence"]["length"]
    if read_seqinfo(folder / "seqinfo.ini").length != length:
        yield _problem(folder / "seqinfo.ini", "another seqLength", length)
    truth = truth_files.read_truth(folder) if (folder / "gt/truth.parquet").is_file() else None
    exact = folder / "det" / "det.parquet"
    detections = truth_files.read_detections(exact) if exact.is_file() else []
    name = hashing.truth_hash(text, manifest["seed"], manifest["repeat"], truth)
    if name != manifest["truth_hash"]:
        yield _problem(folder / manifests.MANIFEST, "another truth_hash", name)
    if hashing.content_hash(name, detections, manifest.get("pixels")) != manifest["content_hash"]:
        yield _problem(folder / manifests.MANIFEST, "another content_hash", "that of the stored content")
    if truth is not None:
        yield from _truth(folder, truth, length)
    yield from _pictures(folder, manifest, length)
    if detections:
        yield from _detections(folder, detections, length, manifest["sequence"]["fps"])


def _pictures(folder: Path, manifest: dict[str, Any], length: int) -> Iterator[FlockscopeError]:
    stored = StoredPictures(folder, manifest)
    named = {name for name in manifest["files"] if is_picture(name)}
    for stream in stored.streams:
        count, digest = BACKGROUNDS if stream == "background" else length, hashing.PixelHash()
        named -= {file_name(stream, stored.images, k) for k in range(1, count + 1)}
        try:
            for picture in stored.all(stream, count):
                digest.add(picture)
        except FlockscopeError as error:
            yield error
            continue
        if suffix(stream, stored.images) == "png" and digest.hex() != manifest["pixels"].get(stream):
            yield _problem(folder / manifests.MANIFEST, f"other pixels of {stream}", "the pictures of their hash")
    for name in sorted(named):
        yield _problem(folder / name, "a picture beyond the last frame", "as many as frames")


def _truth(folder: Path, truth: Truth, length: int) -> Iterator[InputError]:
    if truth.length != length:
        yield _problem(folder / "gt/truth.parquet", f"{truth.length} frames", length)
    for name, body in truth_files.truth_files(truth).items():
        if not name.endswith(".parquet"):
            yield from _text(folder / name, body)
    yield from _groups(folder / "gt/groups.parquet", truth, truth.groups)
    yield from _groups(folder / "gt/groups_px.parquet", truth, truth.groups_px)
    people, path = set(truth.id.tolist()), folder / "gt/events.json"
    for k, event in enumerate(truth.events or ()):
        place = f"events[{k}]"
        if not 1 <= event.start <= event.end <= length:
            yield _problem(path, f"frames {event.start} to {event.end}", f"frames from 1 to {length}", place)
        if not set(event.members) <= people:
            yield _problem(path, f"members {sorted(set(event.members) - people)}", "people of the sequence", place)


def _text(path: Path, wanted: bytes) -> Iterator[InputError]:
    if not path.is_file():
        yield _problem(path, "missing", "the text of the exact table")
        return
    lines, right = path.read_bytes().split(b"\n"), wanted.split(b"\n")
    for k, (got, expected) in enumerate(zip_longest(lines, right, fillvalue=b""), 1):
        if got != expected:
            yield _problem(path, got.decode("utf-8", "replace"), expected.decode(), f"line {k}")
            return


def _groups(path: Path, truth: Truth, groups: tuple[Groups, ...] | None) -> Iterator[InputError]:
    for index, some in enumerate(groups or (), 1):
        here = truth.rows(index)
        group_of = dict(zip(truth.id[here].tolist(), truth.group[here].tolist(), strict=True))
        for group, members in zip(some.id.tolist(), some.members, strict=True):
            if any(group_of.get(m) != group for m in members.tolist()):
                got = f"group {group} of {members.tolist()}"
                yield _problem(path, got, "members with that group in truth.parquet", f"frame {index}")
                return


def _detections(folder: Path, detections: list[Detections], length: int, fps: float) -> Iterator[InputError]:
    if len(detections) != length:
        yield _problem(folder / "det/det.parquet", f"{len(detections)} frames", length)
    scene = read_scene(folder / "scene.json") if (folder / "scene.json").is_file() else None
    yield from _text(folder / "det/det.txt", truth_files.detection_files(detections, fps, scene)["det/det.txt"])
