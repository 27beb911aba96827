"""Writes a dataset or recording as COCO JSON: one file with all sequences that have labelled boxes.

Each frame is an image and each sequence a video. Each person in the picture is an annotation: box (left, top, width,
height in px, unclipped), person id, group id, visibility, and a segmentation. That is the mask of the visible pixels
where the stream ids is stored, else the part of the box inside the picture.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError, reject
from sim import hashing
from sim.dataset.splits import split_of
from sim.scene.visibility import image_size_of_boxes
from sim.store.atomic import write_file
from sim.store.own_files import GENERATOR, output_paths, split_and_name
from sim.store.seal import read_whole_manifest, reject_sealed
from sim.store.tables import json_text
from sim.streams import file_name
from sim.types import Array, Bools, Sequence, Truth
from tracking.recordings.mot_folder import left_pictures
from tracking.recordings.source import open_source

PERSON = {"id": 1, "name": "person", "supercategory": "person"}


def coco(source: str | Path, out: str | Path, *, person_class: int | str | None = None) -> Path:
    """Writes the sequences of a source that have labelled boxes as a COCO file.

    Each frame is an image, each sequence a video, both numbered from 1. Annotations have bbox [left, top, width,
    height] px (amodal, unclipped), segmentation, area, track_id (the person's id), group_id (-1 for alone) and
    visibility.

    Args:
        source: A dataset of one split, or recordings.
        out: The JSON file, replaced if it exists.
        person_class: Classes of people, as `open_source` takes them.

    Returns:
        The path of the file. The same dataset gives the same bytes.

    Raises:
        InputError: No sequence has labelled boxes, two have one name, there are several splits, `out` lies in
            the folder of a stored sequence or a run, or an argument is wrong.
    """
    source, out = Path(source), Path(out)
    reject_sealed(out.parent)
    every = open_source(source, person_class=person_class)
    sequences = [s for s in every if s.truth is not None and s.truth.box is not None]
    reject(not sequences, source, "no labelled boxes", "a dataset with boxes", "give a generated dataset")
    made = [s.source for s in sequences if s.source.get("kind") == "generated"]
    splits = sorted({split_of(range(facts["seed"], facts["seed"] + 1)) for facts in made})
    if len(splits) > 1:
        got, remedy = f"the splits {', '.join(splits)}", f"export each by itself, as {Path(made[0]['path']).parent}"
        raise InputError(file=source, got=got, expected="one split in a file", remedy=remedy)
    output_paths("", [s.name for s in sequences], source=source)
    write_file(out, _document(sequences, source if source.is_dir() else source.parent, out).encode())
    return out


def _document(sequences: list[Sequence], root: Path, path: Path) -> str:
    info: dict[str, Any] = {"description": GENERATOR, "version": "1"}
    if all(s.source.get("kind") == "generated" for s in sequences):
        folders = [Path(s.source["path"]) for s in sequences]
        hashes = {split_and_name(folder): read_whole_manifest(folder)["content_hash"] for folder in folders}
        info["content_hash"] = hashing.dataset_hash(hashes)
    info["root"] = Path(os.path.relpath(root, path.parent)).as_posix()
    videos, images, annotations = [], list[str](), list[str]()
    for k, sequence in enumerate(sequences, 1):
        about = {"id": k, "name": sequence.name, "fps": sequence.fps, "length": sequence.length}
        truth, files = sequence.truth, _picture_files(sequence)
        assert truth is not None
        assert truth.box is not None
        size = sequence.image_size or image_size_of_boxes(truth.box)
        shape = {"width": size[0], "height": size[1]}
        videos.append(json_text({**about, **shape}))
        for index in range(1, (sequence.length or 0) + 1):
            if files and index not in files:
                continue
            name = {"file_name": Path(os.path.relpath(files[index], root)).as_posix()} if files else {}
            images.append(json_text({"id": len(images) + 1, **name, **shape, "video_id": k, "frame": index}))
            shared = {"image_id": len(images), "video_id": k, "category_id": 1}
            for found in _annotations(sequence, truth, truth.box, size, index):
                annotations.append(json_text({"id": len(annotations) + 1, **shared, **found}))
    lists = {"videos": videos, "images": images, "annotations": annotations}
    blocks = [f'"{name}": [\n' + ",\n".join(rows) + "\n]" for name, rows in lists.items()]
    head = f'"info": {json_text(info)}, "licenses": []', f'"categories": [{json_text(PERSON)}]'
    return "{" + ",\n".join([*head, *blocks]) + "}\n"


def _picture_files(sequence: Sequence) -> dict[int, Path]:
    if not sequence.has_images:
        return {}
    folder = Path(sequence.source["path"])
    if sequence.source["kind"] == "mot":
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # said when the sequence was opened
            return left_pictures(folder).files
    images = sequence.source["images"] or "jpg"
    return {index: folder / file_name("left", images, index) for index in range(1, (sequence.length or 0) + 1)}


def _annotations(
    sequence: Sequence, truth: Truth, boxes: Array, size: tuple[int, int], index: int
) -> Iterator[dict[str, Any]]:
    # masks are read down the columns
    ids = None if sequence.load_pixels is None else np.asfortranarray(sequence.load_pixels(index).ids)
    for row in range(*truth.rows(index).indices(len(boxes))):
        box = [round(v, 2) for v in boxes[row].tolist()]
        corners = np.clip([boxes[row, :2], boxes[row, :2] + boxes[row, 2:]], 0, size)
        left, top, right, bottom = np.round(corners.ravel(), 2).tolist()
        if not (right > left and bottom > top):  # also for nan
            continue
        person, area = int(truth.id[row]), round(box[2] * box[3], 2)
        segmentation: Any = [[left, top, right, top, right, bottom, left, bottom]]
        if ids is not None:
            mask = run_lengths(ids == person)
            segmentation, area = {"size": [size[1], size[0]], "counts": mask}, sum(mask[1::2])
        yield {
            "bbox": box, "segmentation": segmentation, "area": area, "iscrowd": 0, "track_id": person,
            "group_id": int(truth.group[row]), "visibility": round(float(truth.visibility[row]), 3),
        }  # fmt: skip


def run_lengths(mask: Bools) -> list[int]:
    """Returns a mask (H, W) as COCO's uncompressed run lengths: down the columns, first outside the mask."""
    edges = np.flatnonzero(np.diff(mask.ravel(order="F"), prepend=False, append=False))
    lengths: list[int] = np.diff(edges, prepend=0, append=mask.size).tolist()
    return lengths
