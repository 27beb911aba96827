"""WebDataset export of single frames: each sample is one picture with its labels, shuffled over tar shards.

A sample has the key <split>/<name>-<frame, 6 digits>, and the members

    jpg or png   the picture of the left camera; a frame of a video becomes jpg
    json         the labels: sequence, frame, t (s), width, height (px), and people
    ids.png      16 bits, 2000 + person id: who is in each pixel; only with the stream ids

Of each of the people: id, group (-1 for alone), box (left, top, width, height in px, of the whole body, unclipped),
visibility, truncation (null if unknown) and ignored. The order is drawn from the seed, so that neighbours in a shard
are of different sequences. Pictures of the empty scene are left out.
"""

from __future__ import annotations

import tarfile
from collections import deque
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import reject
from sim import hashing
from sim.pictures.stored_pictures import StoredPictures
from sim.store import tables
from sim.store.own_files import split_and_name
from sim.store.seal import read_whole_manifest
from sim.streams import file_name
from tracking.export import MIN_VISIBILITY
from tracking.export.labelled_pictures import (
    Exported,
    LabelledPictures,
    in_turn,
    labelled_pictures,
    stored_picture,
)
from tracking.export.webdataset import (
    END,
    Progress,
    add_member,
    file_facts,
    key_of,
    member_bytes,
    new_shards,
    shard_name,
)
from tracking.recordings.source import generated_folders

OPENED = 256  # manifests kept in memory
Sample = tuple[Path, int, bytes]  # folder of the sequence, frame, labels


def frame_shards(
    source: str | Path, out: str | Path, *, shard_size: int = 10**9, seed: int = 0,
    min_visibility: float = MIN_VISIBILITY, progress: Progress | None = None,
) -> tuple[Exported, dict[str, Any]]:  # fmt: skip
    """Packs the frames of a generated dataset into OUT/shard-000000.tar, …, and writes OUT/index.json.

    Args:
        source: A generated sequence or dataset of one split, with the stream left.
        out: The folder; it must be missing, empty, or hold the same export.
        shard_size: Bytes that a shard may have; a larger sample has a shard of its own.
        seed: Of the order of the samples.
        min_visibility: Share of the body from 0 to 1; people of whom less is visible are ignored.
        progress: Called as progress(samples done, samples in all, key of the last one) after each sample.

    Returns:
        The numbers of pictures and people, and the index: format, content_hash, sample, seed, shard_size,
        min_visibility, and of each shard name, samples (their number), bytes and sha256. Equal arguments give the same
        bytes.

    Raises:
        InputError: A sequence is no generated one, has no pictures or labels, or differs from its hashes; there are
            several splits; or `out` holds something else.
    """
    root = Path(out)
    generated_folders(Path(source))  # refuses recordings
    labelled = labelled_pictures(Path(source), min_visibility, pictured=True, one_split=True)
    folders = [Path(each.sequence.source["path"]) for each in labelled]
    hashes = {split_and_name(folder): read_whole_manifest(folder)["content_hash"] for folder in folders}
    reject(len(hashes) < len(folders), source, "two sequences of one name", "unique names", "export them apart")
    plan: dict[str, Any] = {
        "format": tables.FORMAT, "content_hash": hashing.dataset_hash(hashes), "sample": "frame", "seed": seed,
        "shard_size": shard_size, "min_visibility": min_visibility,
    }  # fmt: skip
    samples, kept, ignored = list[Sample](), 0, 0
    for each, folder in zip(in_turn(labelled), folders, strict=True):
        for index in range(1, each.truth.length + 1):
            document = labels(each, index)
            hidden = sum(person["ignored"] for person in document["people"])
            kept, ignored = kept + len(document["people"]) - hidden, ignored + hidden
            samples.append((folder, index, tables.json_text(document).encode()))
    order = np.random.default_rng(seed).permutation(len(samples)).tolist()
    with new_shards(root, plan) as (partial, shards):
        _write(partial, shards, [samples[k] for k in order], shard_size, progress)
    return Exported(root, len(samples), kept, ignored, min_visibility), {**plan, "shards": shards}


def labels(labelled: LabelledPictures, index: int) -> dict[str, Any]:
    """Returns the document with the labels of the picture of frame `index` (from 1)."""
    people, truth, (width, height) = labelled.people(index), labelled.truth, labelled.size
    outside = np.full(len(people.id), np.nan) if truth.truncation is None else truth.truncation[people.rows]
    columns = {
        "id": people.id, "group": people.group, "box": people.box.round(2), "visibility": people.visibility.round(3),
        "truncation": outside.round(3), "ignored": people.ignored,
    }  # fmt: skip
    rows = zip(*(tables.plain(column) for column in columns.values()), strict=True)
    return {
        "sequence": labelled.sequence.name, "frame": index, "t": (index - 1) / labelled.sequence.fps,
        "width": width, "height": height, "people": [dict(zip(columns, row, strict=True)) for row in rows],
    }  # fmt: skip


def _write(
    folder: Path, shards: list[dict[str, Any]], samples: list[Sample], shard_size: int, progress: Progress | None
) -> None:
    @lru_cache(maxsize=OPENED)
    def stored(sequence: Path) -> StoredPictures:
        return StoredPictures(sequence, read_whole_manifest(sequence))

    def members(sample: Sample) -> list[tuple[str, bytes]]:
        sequence, index, document = sample
        pictures, key = stored(sequence), f"{key_of(sequence)}-{index:06d}"
        body, kind = stored_picture(pictures, index)
        found = [(f"{key}.{kind}", body), (f"{key}.json", document)]
        if "ids" in pictures.streams:
            ids = pictures.check(file_name("ids", pictures.images, index), whole=True)
            found.append((f"{key}.ids.png", ids))
        return found

    waiting = deque(samples)
    while waiting:
        name, full, count = shard_name(len(shards)), END, 0
        with tarfile.open(folder / name, "w", format=tarfile.GNU_FORMAT) as tar:
            while waiting:
                found = members(waiting[0])
                full += sum(member_bytes(member, len(body)) for member, body in found)
                if count and full > shard_size:
                    break
                for member, body in found:
                    add_member(tar, member, body)
                waiting.popleft()
                count += 1
                if progress is not None:
                    progress(len(samples) - len(waiting), len(samples), found[0][0])
        shards.append({"name": name, "samples": count, **file_facts(folder / name)})
