"""Writes a dataset or recording as COCO JSON: one file with all sequences that have labelled boxes.

Each frame is an image and each sequence a video. Each person in the picture is an annotation: box (left, top, width,
height in px, unclipped), person id, group id, visibility, and, where the stream ids is stored, the mask of the visible
pixels. Without it there is no segmentation: the box as a mask would be a false one.

Ignored people have `iscrowd` 1, as only that makes an ignored region: COCO's evaluator (and pycocotools) overwrites
`ignore` by `iscrowd` when it loads a file. Who misses the person loses nothing, and neither does who reports a box or
mask inside the region. Training code leaves out `iscrowd`, or ignores it, too. Without these annotations a detector
that does find the person would pay for a false alarm.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from sim import hashing
from sim.store.atomic import write_file
from sim.store.own_files import GENERATOR, output_paths, split_and_name
from sim.store.seal import read_whole_manifest, reject_sealed
from sim.store.tables import json_text
from sim.types import Bools, Sequence
from tracking.export import MIN_VISIBILITY
from tracking.export.labelled_pictures import Exported, LabelledPictures, in_turn, labelled_pictures

PERSON = {"id": 1, "name": "person", "supercategory": "person"}


def coco(
    source: str | Path, out: str | Path, *, person_class: int | str | None = None,
    min_visibility: float = MIN_VISIBILITY,
) -> Exported:  # fmt: skip
    """Writes the sequences of a source that have labelled boxes as a COCO file.

    Each frame is an image, each sequence a video, both numbered from 1. Annotations have bbox [left, top, width,
    height] px (amodal, unclipped), area, iscrowd, track_id (the person's id), group_id (-1 for alone), subgroup_id of
    scenes with sub-groups, visibility, and with the stream ids a segmentation.

    Args:
        source: A dataset of one split, or recordings.
        out: The JSON file, replaced if it exists.
        person_class: Classes of people, as `open_source` takes them.
        min_visibility: Share of the body from 0 to 1; people of whom less is visible have iscrowd 1.

    Returns:
        The path of the file with the numbers of its images and annotations. The same dataset gives the same bytes.

    Raises:
        InputError: No sequence has labelled boxes, two have one name, there are several splits, `out` lies in
            the folder of a stored sequence or a run, or an argument is wrong.
    """
    source, out = Path(source), Path(out)
    reject_sealed(out.parent)
    labelled = labelled_pictures(source, min_visibility, person_class=person_class, one_split=True)
    output_paths("", [each.sequence.name for each in labelled], source=source)
    root = source if source.is_dir() else source.parent
    videos, images, annotations, ignored = [], list[str](), list[str](), 0
    for k, each in enumerate(in_turn(labelled), 1):
        sequence, files = each.sequence, each.files()
        shape = dict(zip(("width", "height"), each.size, strict=True))
        about = {"id": k, "name": sequence.name, "fps": sequence.fps, "length": sequence.length}
        videos.append(json_text({**about, **shape}))
        for index in range(1, (sequence.length or 0) + 1):
            if files and index not in files:
                continue
            name = {"file_name": Path(os.path.relpath(files[index], root)).as_posix()} if files else {}
            images.append(json_text({"id": len(images) + 1, **name, **shape, "video_id": k, "frame": index}))
            shared = {"image_id": len(images), "video_id": k, "category_id": 1}
            for found in _annotations(each, index):
                ignored += found["iscrowd"]
                annotations.append(json_text({"id": len(annotations) + 1, **shared, **found}))
    lists = {"videos": videos, "images": images, "annotations": annotations}
    write_file(out, _document([each.sequence for each in labelled], lists, root, out).encode())
    return Exported(out, len(images), len(annotations) - ignored, ignored, min_visibility)


def _document(sequences: list[Sequence], lists: dict[str, list[str]], root: Path, path: Path) -> str:
    info: dict[str, Any] = {"description": GENERATOR, "version": "1"}
    if all(s.source.get("kind") == "generated" for s in sequences):
        folders = [Path(s.source["path"]) for s in sequences]
        hashes = {split_and_name(folder): read_whole_manifest(folder)["content_hash"] for folder in folders}
        info["content_hash"] = hashing.dataset_hash(hashes)
    info["root"] = Path(os.path.relpath(root, path.parent)).as_posix()
    blocks = [f'"{name}": [\n' + ",\n".join(rows) + "\n]" for name, rows in lists.items()]
    head = f'"info": {json_text(info)}, "licenses": []', f'"categories": [{json_text(PERSON)}]'
    return "{" + ",\n".join([*head, *blocks]) + "}\n"


def _annotations(labelled: LabelledPictures, index: int) -> Iterator[dict[str, Any]]:
    people, (width, height) = labelled.people(index), labelled.size
    for k, person in enumerate(people.id.tolist()):
        box = [round(v, 2) for v in people.box[k].tolist()]
        shape: dict[str, Any] = {"area": round(box[2] * box[3], 2)}
        if people.ids is not None:
            mask = run_lengths(people.ids == person)
            shape = {"segmentation": {"size": [height, width], "counts": mask}, "area": sum(mask[1::2])}
        own = {} if labelled.truth.subgroup is None else {"subgroup_id": int(labelled.truth.subgroup[people.rows[k]])}
        yield {
            "bbox": box, **shape, "iscrowd": int(people.ignored[k]), "track_id": person,
            "group_id": int(people.group[k]), **own, "visibility": round(float(people.visibility[k]), 3),
        }  # fmt: skip


def run_lengths(mask: Bools) -> list[int]:
    """Returns a mask (H, W) as COCO's uncompressed run lengths: down the columns, first outside the mask."""
    edges = np.flatnonzero(np.diff(mask.ravel(order="F"), prepend=False, append=False))
    lengths: list[int] = np.diff(edges, prepend=0, append=mask.size).tolist()
    return lengths
