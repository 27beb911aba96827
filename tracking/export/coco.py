"""Writes a dataset or recording as COCO JSON: all sequences that have labelled boxes, in one file or several parts.

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
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import reject
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
    min_visibility: float = MIN_VISIBILITY, part_size: int | None = None,
) -> Exported:  # fmt: skip
    """Writes the sequences of a source that have labelled boxes as a COCO file, or as several.

    Each frame is an image, each sequence a video, both numbered from 1. Annotations have bbox [left, top, width,
    height] px (amodal, unclipped), area, iscrowd, track_id (the person's id), group_id (-1 for alone), subgroup_id of
    scenes with sub-groups, visibility, and with the stream ids a segmentation.

    Args:
        source: A dataset of one split, or recordings.
        out: The JSON file, replaced if it exists. Parts are named after it: coco.json gives coco-0000.json, ….
        person_class: Classes of people, as `open_source` takes them.
        min_visibility: Share of the body from 0 to 1; people of whom less is visible have iscrowd 1.
        part_size: Number of sequences in a file; None: all in one. Each part is a COCO file by itself; numbers of
            videos, images and annotations go on from part to part, and only one part is in memory.

    Returns:
        The path `out` with the numbers of images and annotations, and the files. The same dataset gives the same bytes.

    Raises:
        InputError: No sequence has labelled boxes, two have one name, there are several splits, `out` lies in
            the folder of a stored sequence or a run, parts of another export lie beside it, or an argument is wrong.
    """
    source, out = Path(source), Path(out)
    few = part_size is not None and part_size < 1
    reject(few, "", part_size, "a number of sequences above 0", "correct it", "--part-size")
    reject_sealed(out.parent)
    labelled = labelled_pictures(source, min_visibility, person_class=person_class, one_split=True)
    output_paths("", [each.sequence.name for each in labelled], source=source)
    root = source if source.is_dir() else source.parent
    size = len(labelled) if part_size is None else part_size
    paths = [out] if part_size is None else [_part(out, k) for k in range(-(-len(labelled) // size))]
    _reject_other_parts(out, paths)
    counts = _Counts()
    for k, path in enumerate(paths):
        some = labelled[k * size : (k + 1) * size]
        lists = _lists(some, root, counts)
        write_file(path, _document([each.sequence for each in some], lists, root, path).encode())
    kept = counts.annotations - counts.ignored
    return Exported(out, counts.images, kept, counts.ignored, min_visibility, tuple(paths))


def _part(out: Path, number: int) -> Path:
    return out.with_name(f"{out.stem}-{number:04d}{out.suffix}")


def _reject_other_parts(out: Path, paths: list[Path]) -> None:
    found = re.compile(re.escape(out.stem) + r"-\d{4,}" + re.escape(out.suffix))
    others = [p for p in sorted(out.parent.glob("*")) if found.fullmatch(p.name)] if paths != [out] else []
    other = next((path for path in others if path not in paths), None)
    remedy = "delete the parts of the earlier export, or choose another --out"
    reject(other is not None, other or "", "a part of another export", f"at most {len(paths)} parts", remedy)


@dataclass
class _Counts:
    """Numbers of videos, images and annotations written so far, and of those annotations that are ignored."""

    videos: int = 0
    images: int = 0
    annotations: int = 0
    ignored: int = 0


def _lists(labelled: list[LabelledPictures], root: Path, counts: _Counts) -> dict[str, list[str]]:
    """Returns the rows of a file as JSON, by the name of their list; adds their numbers to `counts`."""
    videos, images, annotations = list[str](), list[str](), list[str]()
    for each in in_turn(labelled):
        sequence, files = each.sequence, each.files()
        shape = dict(zip(("width", "height"), each.size, strict=True))
        counts.videos += 1
        about = {"id": counts.videos, "name": sequence.name, "fps": sequence.fps, "length": sequence.length}
        videos.append(json_text({**about, **shape}))
        outside = files and not files[min(files)].absolute().is_relative_to(root.absolute())
        got, remedy = "pictures in a shard", "unpack it with tar, and export the folders"
        reject(outside, root, got, "pictures in folders, which the file can name", remedy)
        for index in range(1, (sequence.length or 0) + 1):
            if files and index not in files:
                continue
            counts.images += 1
            name = {"file_name": Path(os.path.relpath(files[index], root)).as_posix()} if files else {}
            images.append(json_text({"id": counts.images, **name, **shape, "video_id": counts.videos, "frame": index}))
            shared = {"image_id": counts.images, "video_id": counts.videos, "category_id": 1}
            for found in _annotations(each, index):
                counts.ignored += found["iscrowd"]
                counts.annotations += 1
                annotations.append(json_text({"id": counts.annotations, **shared, **found}))
    return {"videos": videos, "images": images, "annotations": annotations}


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
