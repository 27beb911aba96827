"""Seals: a JSON document, written last into a folder, that names each file with its hash, and the hash of itself.

manifest.json seals a stored sequence, run.json the tracks of a run: they are complete if and only if they have one.
manifest.json also holds the identity of the sequence and versions, but no time, host or path, so the same seed,
scenario and versions give the same bytes. run.json says which tracker ran and on what.
"""

from __future__ import annotations

import json
from collections.abc import Container, Iterable, Iterator, Mapping
from pathlib import Path, PurePosixPath
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, Field, StrictBool

from scenarios.errors import InputError, reject
from scenarios.limits import INTEGER, PICTURE_SIZES, fits_picture
from sim import hashing
from sim.store import tables
from sim.store.own_files import Marks, is_ours
from sim.store.tables import Count, FrameNumber, Id, Rate, Scale, validated
from sim.streams import IMAGES, STREAMS, check_streams, coding, file_name
from sim.types import BACKGROUNDS, Sequence

MANIFEST, RUN = "manifest.json", "run.json"
# what every manifest.json and run.json of ours has, and no other program writes
SHARDS = "*-s[0-9]*.tar"  # names of the shards of packed datasets
MARKS: Marks = {"scenario_hash": str, "content_hash": str}
RUN_MARKS: Marks = {"boxes": str}

REDO = "run the same `flockscope generate` again"
AGAIN = "track again"
ANOTHER, FOR_RUNS = "choose another --out", "a new folder, or one with a run"
OLD = "delete run.json, then track again; tracks of another program are read without it"

EXACT = "tracks.parquet"
PAIRS = "pairs.parquet"
# names of the files of a run; files of other names in its folder belong to somebody else
NAMES = ("tracks.txt", "tracks.mot.txt", EXACT, "groups.csv", "groups.parquet", PAIRS, "events.json", RUN)
# files that stand for the whole run if they are given alone; tracks.mot.txt is a text as other programs read it
WHOLE = ("tracks.txt", EXACT)


def _inside(name: str) -> str:
    path = PurePosixPath(name)
    if not name or path.is_absolute() or ".." in path.parts or "\0" in name:
        raise ValueError("names inside the folder")
    return name


def _size(size: tuple[int, int]) -> tuple[int, int]:
    if not fits_picture(*size):
        raise ValueError(f"[width, height], {PICTURE_SIZES}")
    return size


class _Facts(BaseModel):
    """What a seal states of a file."""

    sha256: str
    bytes: Id


class _SequenceFacts(BaseModel):
    name: str
    fps: Rate
    length: Count
    image_size: Annotated[tuple[Id, Id], AfterValidator(_size)] | None
    px_per_m: Scale | None


FILES = dict[Annotated[str, AfterValidator(_inside)], _Facts]
TABLE = (dict[str, Any] | None, None)
TEXT = (str | None, None)
# the keys of manifest.json that readers use, and those of run.json that commands read
MANIFEST_KEYS = tables.model(
    files=FILES, truth_hash=str, format=Any, sequence=_SequenceFacts, seed=Id, repeat=Id, content_hash=str,
    scenario_hash=str, streams=(tuple[Literal[STREAMS], ...], ()),  # type: ignore[valid-type]
    images=(Literal[IMAGES] | None, None), stride=(FrameNumber, 1),
)  # fmt: skip
RUN_KEYS = tables.model(
    files=FILES, truth_hash=TEXT, boxes=Literal["measured", "projected", "none"], tracker=(str, ""), sequence=(str, ""),
    config=TABLE, grouping=TABLE, sensor=TABLE,
    seed=(Annotated[int, Field(strict=True, ge=-INTEGER, le=INTEGER)] | None, None),
    detections=TEXT, background=TEXT, plane=TEXT, causal=(StrictBool | None, None), fps=(Rate | None, None),
    px_per_m=(Annotated[float, Field(strict=True)] | None, None),
)  # fmt: skip


def file_facts(files: Mapping[str, bytes | Path]) -> dict[str, dict[str, Any]]:
    """Returns {"sha256": …, "bytes": size} for each file, by name, sorted. files: content or path, by name."""
    sizes = {name: len(body) if isinstance(body, bytes) else body.stat().st_size for name, body in files.items()}
    return {name: {"sha256": hashing.file_hash(body), "bytes": sizes[name]} for name, body in sorted(files.items())}


def with_hash(document: dict[str, Any]) -> dict[str, Any]:
    """Returns a copy of the document in which the key sha256 holds the hash of all other keys and values."""
    body = {key: value for key, value in document.items() if key != "sha256"}
    return {**body, "sha256": hashing.canonical_hash(body)}


def _read(path: Path, kind: type[BaseModel], remedy: str) -> dict[str, Any]:
    document = tables.read_document(path, OLD if kind is RUN_KEYS else remedy)
    if document.get("sha256") != with_hash(document)["sha256"]:
        raise InputError(file=path, got="altered fields", expected="those that its sha256 names", remedy=remedy)
    validated(path, document, kind, remedy)
    return document


def damaged_files(
    folder: Path, files: dict[str, Any], seal: str = MANIFEST, remedy: str = REDO, size_only: Container[str] = ()
) -> Iterator[InputError]:
    """Yields an error for each file that is missing, unreadable or not as stated.

    files: size and hash by name, as of `file_facts`. seal: name of the document that states them. size_only: names of
    files of which only the size is compared.
    """
    for name, facts in files.items():
        try:
            check_file(folder / name, facts, seal, remedy, name in size_only)
        except InputError as error:
            yield error


def check_file(
    path: Path, facts: Mapping[str, Any], seal: str = MANIFEST, remedy: str = REDO, size_only: bool = False,
    whole: bool = False,
) -> bytes:  # fmt: skip
    """Raises InputError if a file differs from the facts that a seal states of it.

    size_only: True compares the size alone. Returns the bytes of the file if `whole`, else b"".
    """
    size = None
    try:
        if path.is_file():  # a FIFO would block its reader
            size = path.stat().st_size
            if size == facts["bytes"]:
                body = path.read_bytes() if whole else b""
                if size_only or hashing.file_hash(body if whole else path) == facts["sha256"]:
                    return body
    except OSError:
        size = None
    kind = "truncated" if size is not None and size < facts["bytes"] else "altered"
    got = "missing" if size is None else f"{kind}: {size} bytes"
    expected = f"the file of {facts['bytes']} bytes that {seal} names"
    raise InputError(file=path, got=got, expected=expected, remedy=remedy)


def is_sequence(folder: Path) -> bool:
    """Returns True if the folder is a stored sequence, complete or not: it has manifest.json or scenario.toml."""
    return (folder / MANIFEST).is_file() or (folder / "scenario.toml").is_file()


def is_dataset(path: Path) -> bool:
    """Returns True if the folder is a stored sequence, a split of a dataset, or a dataset, perhaps a damaged one."""
    found = (manifest for below in ("", "*/", "*/*/") for manifest in path.glob(below + MANIFEST))
    shards = (tar.with_suffix(".parquet") for below in ("", "*/", "*/*/") for tar in path.glob(below + SHARDS))
    return any(is_ours(manifest, MARKS) is not False for manifest in found) or any(map(is_ours, shards))


def is_own_sequence(folder: Path) -> bool:
    """Returns True if flockscope wrote the manifest in the folder, or any Parquet table in or below it."""
    return any(is_ours(path, MARKS) for path in (folder / MANIFEST, *folder.rglob("*.parquet")))


def identity(scenario: str, seed: int, repeat: int, streams: Iterable[str] = (), images: str = "jpg") -> dict[str, Any]:
    """Returns the fields of a manifest that identify a sequence.

    scenario: TOML text of the resolved scenario. repeat: number of the suite entry's copy, 0 without copies. streams:
    all that are stored.
    """
    wanted = check_streams(streams, images, background=False)
    return {
        "format": tables.FORMAT, "schema": 1, "engine": hashing.ENGINE, "seed": seed, "repeat": repeat,
        "scenario_hash": hashing.scenario_hash(scenario), "streams": list(wanted), "images": coding(wanted, images),
    }  # fmt: skip


def read_manifest(folder: Path) -> dict[str, Any]:
    """Returns the manifest.json of a sequence folder; checks its own hash and its values, but no other file."""
    path = folder / MANIFEST
    reject(not path.is_file(), path, "missing", "the manifest of a complete sequence", REDO)
    manifest = _read(path, MANIFEST_KEYS, REDO)
    unsized = manifest.get("streams") and manifest["sequence"]["image_size"] is None
    reject(unsized, path, "null", "the size of the pictures", REDO, "sequence.image_size")
    return manifest


def read_whole_manifest(folder: Path) -> dict[str, Any]:
    """Returns the manifest of a sequence that is exported: it must name every file of the sequence."""
    manifest = read_manifest(folder)
    length, images = manifest["sequence"]["length"], manifest.get("images") or "png"
    wanted = ["scenario.toml", "seqinfo.ini"]
    for stream in manifest.get("streams", ()):
        count = BACKGROUNDS if stream == "background" else length
        wanted += [file_name(stream, images, k) for k in range(1, count + 1)]
    expected = "every file of the sequence"
    first, *more = [name for name in wanted if name not in manifest["files"]] or [""]
    got = f"no {first}" + (f" and {len(more)} more" if more else "")
    reject(first, folder / MANIFEST, got, expected, REDO, "files")
    # A stranger's dataset must not make an export read files elsewhere.
    got, remedy = "a link that leads out of the sequence", "export a copy that holds the files (cp -rL)"
    for path in (folder / name for name in (MANIFEST, *manifest["files"])):
        reject(not path.resolve().is_relative_to(folder.resolve()), path, got, expected, remedy)
    return manifest


def is_run(folder: Path) -> bool:
    """Returns True if the folder holds a run that flockscope wrote, perhaps an unfinished or damaged one."""
    paths = [folder / name for name in (RUN, EXACT) if (folder / name).is_file()]
    # A file that cannot be parsed may be ours.
    return any(is_ours(path, RUN_MARKS) is not False for path in paths)


def run_folder(path: Path) -> Path | None:
    """Returns the run's folder, if `path` is this folder or a file of the run in it; else None."""
    folder = path if path.is_dir() else path.parent if path.name in NAMES else None
    return folder if folder is not None and is_run(folder) else None


def reject_foreign(folder: Path) -> None:
    """Raises InputError if writing a run into `folder` would change a foreign file or a stored sequence."""
    reject_dataset(folder)
    found = [folder / name for name in (RUN, EXACT, *NAMES) if (folder / name).exists()]
    if found and not is_ours(found[0], RUN_MARKS):
        got, remedy = "a file of another program, or a damaged one", f"{ANOTHER}, or move it; delete a damaged run"
        raise InputError(file=found[0], got=got, expected=FOR_RUNS, remedy=remedy)


def reject_dataset(folder: Path) -> None:
    """Raises InputError if `folder` is a dataset or lies in a stored sequence, where no tracks or tables belong."""
    place = next((p for p in (folder.absolute(), *folder.absolute().parents) if is_ours(p / MANIFEST, MARKS)), None)
    got = "a generated dataset" if place is None else f"a place inside the stored sequence {place.name}"
    reject(place is not None or is_dataset(folder), folder, got, FOR_RUNS, ANOTHER)


def reject_runs(folder: Path) -> None:
    """Raises InputError if `folder` is that of runs and no dataset yet: no sequences are written beside them."""
    if any(map(is_run, (folder, *folder.glob("*")))) and not is_dataset(folder):
        raise InputError(file=folder, got="a folder of tracks", expected="a new folder, or a dataset", remedy=ANOTHER)


def reject_sealed(folder: Path) -> None:
    """Raises InputError if `folder` is that of a run or of a stored sequence, into which no export is written."""
    sealed = is_run(folder) or is_ours(folder / MANIFEST, MARKS)
    reject(sealed, folder, "a folder of tracks or of a sequence", "another folder", ANOTHER, "--out")


def sealed_run(info: Mapping[str, Any], files: Mapping[str, bytes]) -> bytes:
    """Returns the content of run.json: `info`, size and hash of each of `files` (content by name), its own hash."""
    stated = {"format": tables.FORMAT, **info, "files": file_facts(files)}
    read = json.loads(tables.json_text(stated))  # hashed as it will be read
    validated(Path(RUN), read, RUN_KEYS, "correct info")
    return tables.json_document(with_hash(read))


def read_run(folder: Path) -> dict[str, Any]:
    """Returns the run.json of a folder, with its own hash checked; no other file is read."""
    got, expected = f"tracks without {RUN}", "a run that was finished"
    reject(not (folder / RUN).is_file(), folder, got, expected, f"incomplete: {AGAIN}")
    return _read(folder / RUN, RUN_KEYS, AGAIN)


def run_problems(folder: Path, run: dict[str, Any]) -> Iterator[InputError]:
    """Yields an error for each file of a run that is missing, altered, or not named in `run`, its run.json."""
    yield from damaged_files(folder, run["files"], RUN, AGAIN)
    got, expected = f"a file that {RUN} does not name", "the files of one run"
    for path in (folder / name for name in NAMES if name not in run["files"] and name != RUN):
        if path.exists():
            yield InputError(file=path, got=got, expected=expected, remedy=AGAIN)


def check_run(folder: Path) -> dict[str, Any]:
    """Returns the run.json of a folder; raises InputError for the first problem of `run_problems`."""
    run = read_run(folder)
    for problem in run_problems(folder, run):
        raise problem
    return run


def tracked_hash(sequence: Sequence) -> str | None:
    """Returns the SHA-256 of a sequence's truth: the stored truth_hash, else the labels_hash; None without a truth."""
    stated: str | None = sequence.source.get("truth_hash")
    return hashing.labels_hash(sequence.truth) if stated is None and sequence.truth is not None else stated
