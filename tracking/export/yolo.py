"""Writes labelled pictures in the layout of YOLO: images/<split>/, labels/<split>/ with the same names, data.yaml.

A label is a text with a line `0 x y width height` for each person: class 0, then the centre and the size of the box as
shares of the picture. Boxes are of the whole body, clipped to the picture, as loaders refuse others. The format has no
ignored regions: ignored people have no line. A picture without people has an empty label.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sim.store.atomic import write_inside
from sim.store.own_files import GENERATOR, output_paths
from tracking.export import MIN_VISIBILITY
from tracking.export.labelled_pictures import (
    Exported,
    PicturePeople,
    in_turn,
    labelled_pictures,
    new_export,
)

KEYS = ("train", "val", "test")  # of data.yaml; trainers want the first two


def yolo(
    source: str | Path, out: str | Path, *, person_class: int | str | None = None,
    min_visibility: float = MIN_VISIBILITY,
) -> Exported:  # fmt: skip
    """Writes the pictures and boxes of a source for detectors of the YOLO family.

    Args:
        source: A dataset, of any number of splits, or recordings with pictures, which are of the split train.
        out: The folder; only an earlier export is replaced.
        person_class: Classes of people, as `open_source` takes them.
        min_visibility: Share of the body from 0 to 1; people of whom less is visible are left out.

    Returns:
        The folder with the numbers of its pictures and boxes.

    Raises:
        InputError: No sequence has pictures and labelled boxes, two have one name, `out` holds other files, or an
            argument is wrong.
    """
    labelled = labelled_pictures(Path(source), min_visibility, person_class=person_class, pictured=True)
    names = [path.name for path in output_paths("", [each.sequence.name for each in labelled], source=source)]
    pictures, kept, ignored = 0, 0, 0
    with new_export(Path(out)) as root:
        for each, name in zip(in_turn(labelled), names, strict=True):
            for index, body, kind in each.pictures():
                stem, people = f"{each.split}/{name}-{index:06d}", each.people(index)
                hidden = int(people.ignored.sum())
                write_inside(root / f"images/{stem}.{kind}", body)
                write_inside(root / f"labels/{stem}.txt", label(people, each.size).encode())
                pictures, kept, ignored = pictures + 1, kept + len(people.id) - hidden, ignored + hidden
        splits = {each.split for each in labelled}
        lines = [f"{split}: images/{split}" for split in sorted(splits, key=(*KEYS, *sorted(splits)).index)]
        write_inside(root / "data.yaml", "\n".join([f"# {GENERATOR}", *lines, "names:", "  0: person", ""]).encode())
    return Exported(Path(out), pictures, kept, ignored, min_visibility)


def label(people: PicturePeople, size: tuple[int, int]) -> str:
    """Returns the label of a picture: a line for each person who is not ignored. size: width and height, px."""
    corners = people.part[~people.ignored] / [*size, *size]
    middle, sides = (corners[:, :2] + corners[:, 2:]) / 2, corners[:, 2:] - corners[:, :2]
    return "".join(f"0 {x:.6f} {y:.6f} {w:.6f} {h:.6f}\n" for x, y, w, h in np.hstack([middle, sides]).tolist())
