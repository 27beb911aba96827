"""Writes a dataset or recording as one COCO JSON file, with all sequences that have labelled boxes.

Each frame is an image and each sequence a video. Each box of a person is an annotation (left, top, width, height in px,
unclipped), with the person's id, group id and visibility. Boxes that are unknown (nan) are left out.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError
from sim.io.files.atomic import write_file
from sim.io.files.output_paths import output_paths
from sim.io.files.tables import json_text
from sim.io.source import open_source
from sim.io.store.streams import file_name
from sim.io.store.validate import content_hash
from sim.types import Sequence, Truth

PERSON = {"id": 1, "name": "person", "supercategory": "person"}


def coco(source: str | Path, out: str | Path) -> Path:
    """Write a COCO file with every sequence of a source that has labelled boxes, and return its path.

    source: path of a dataset or recording. out: the JSON file, replaced if it exists. Each frame is an image, each
    sequence a video, both numbered from 1. Annotations have bbox [left, top, width, height] px (amodal, unclipped),
    track_id (the person's id), group_id (-1 for alone, or where no groups are labelled) and visibility; rows with an
    unknown box are left out. file_name is the frame's picture or video, also where none is stored, in a folder named
    for the sequence. An unknown image size is replaced by the extent of the boxes. info has the content hash if all
    exported sequences are generated. The same dataset gives the same bytes.

    Raises InputError if the source cannot be opened, a file of it is invalid, no sequence has labelled boxes, two
    sequences would share a folder, or `out` cannot be written; WorkError if the disk is full.
    """
    sequences = [s for s in open_source(source, images=False) if s.truth is not None and s.truth.box is not None]
    if not sequences:
        raise InputError(
            file=source, got="no labelled boxes", expected="a dataset with boxes", remedy="give a generated dataset"
        )
    starts = np.cumsum([0, *(s.length or 0 for s in sequences)]).tolist()
    videos = [_video(k, s) for k, s in enumerate(sequences, 1)]
    folders = output_paths("", [s.name for s in sequences], source=source)
    images = chain.from_iterable(_images(k, s, folders[k - 1], starts[k - 1]) for k, s in enumerate(sequences, 1))
    rows = chain.from_iterable(_annotations(k, s, starts[k - 1]) for k, s in enumerate(sequences, 1))
    numbered = ({"id": k, **row} for k, row in enumerate(rows, 1))
    ours = all(s.source.get("kind") == "generated" for s in sequences)
    info = {"description": "flockscope", "version": "1"} | ({"content_hash": content_hash(source)} if ours else {})
    blocks = (
        f'"info": {json_text(info)}, "licenses": []',
        f'"categories": [{json_text(PERSON)}]',
        _block("videos", videos),
        _block("images", images),
        _block("annotations", numbered),
    )
    write_file(Path(out), ("{" + ",\n".join(blocks) + "}\n").encode())
    return Path(out)


def _block(name: str, rows: Any) -> str:
    return f'"{name}": [\n' + ",\n".join(json_text(row) for row in rows) + "\n]"


def _size(sequence: Sequence) -> dict[str, int]:
    """Return {"width", "height"} of the sequence's pictures in px; for an unknown image size, the extent of the boxes.

    The extent is the highest right and lower edge, rounded up, at least 1. The sequence must have a truth with boxes.
    """
    if sequence.image_size is not None:
        return {"width": sequence.image_size[0], "height": sequence.image_size[1]}
    truth = sequence.truth
    assert truth is not None
    assert truth.box is not None
    right, bottom = np.ceil((truth.box[:, :2] + truth.box[:, 2:]).max(axis=0, initial=1)).astype(int).tolist()
    return {"width": right, "height": bottom}


def _video(k: int, sequence: Sequence) -> dict[str, Any]:
    return {"id": k, "name": sequence.name, "fps": sequence.fps, "length": sequence.length, **_size(sequence)}


def _images(k: int, sequence: Sequence, folder: Path, before: int) -> Iterator[dict[str, Any]]:
    size = _size(sequence)
    images = sequence.source.get("images") or "jpg"
    for index in range(1, (sequence.length or 0) + 1):
        name = f"{folder.name}/{file_name('left', images, index)}"
        yield {"id": before + index, "file_name": name, **size, "video_id": k, "frame": index}


def _annotations(k: int, sequence: Sequence, before: int) -> Iterator[dict[str, Any]]:
    truth: Truth | None = sequence.truth
    assert truth is not None
    assert truth.box is not None
    for row in np.flatnonzero(np.isfinite(truth.box).all(axis=1)):
        box = [round(v, 2) for v in truth.box[row].tolist()]
        yield {
            "image_id": before + int(truth.frame[row]), "video_id": k, "category_id": 1, "bbox": box,
            "area": round(box[2] * box[3], 2), "iscrowd": 0, "track_id": int(truth.id[row]),
            "group_id": int(truth.group[row]), "visibility": round(float(truth.visibility[row]), 3),
        }  # fmt: skip
