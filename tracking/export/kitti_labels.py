"""Labels of people in the format of the tracking benchmark of KITTI, beside the pictures of `tracking.export.kitti`.

OUT/<split>/label_02/<name>.txt has a line for each person in each picture; OUT/<split>/evaluate_tracking.seqmap.<split>
lists the sequences and their lengths, so that TrackEval reads OUT/<split> as GT_FOLDER. Numbers of frames count from 0,
as in KITTI: number k belongs to the picture k + 1. The 17 cells of a line are

    frame id type truncated occluded alpha left top right bottom height width length x y z rotation_y

truncated: 0 if less than 0.15 of the body is outside the picture, 1 up to 0.5, 2 above. occluded: of the part inside
the picture, 0 if at most 0.2 is hidden, 1 up to 0.5, 2 above. An ignored person has 3, and evaluators leave out the
person and who is reported there. The box is that of the whole body, clipped to the picture; whole numbers are the
centres of pixels, as in calib.txt. Sizes and the middle of the feet x, y, z are in m, in coordinates of the left
camera. rotation_y (rad) is the direction of the body about the camera's y axis, 0 along its x axis; alpha is the same,
seen along the ray to the person. Without a pinhole camera the last eight cells and alpha are KITTI's "unknown".
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from sim.scene.body import DEPTH_SHARE, SHOULDER_SHARE
from sim.store.atomic import write_file
from sim.store.own_files import split_and_name
from sim.store.seal import reject_sealed
from sim.types import Array, Ints
from tracking.export import MIN_VISIBILITY
from tracking.export.labelled_pictures import (
    Exported,
    LabelledPictures,
    PicturePeople,
    in_turn,
    labelled_pictures,
)

TRUNCATED = (0.15, 0.5)  # least shares outside the picture of levels 1 and 2
OCCLUDED = (0.2, 0.5)  # least hidden shares above levels 0 and 1
HIDDEN = 3  # of the levels of occlusion the one that evaluators leave out
UNKNOWN = np.array([-10, -1, -1, -1, -1000, -1000, -1000, -10.0])  # alpha, size, place, rotation_y


def kitti_labels(source: str | Path, out: str | Path, *, min_visibility: float = MIN_VISIBILITY) -> Exported:
    """Writes the labels of a generated dataset in the layout of KITTI's tracking benchmark.

    Args:
        source: A sequence or dataset with boxes.
        out: The folder; labels of an earlier export are replaced.
        min_visibility: Share of the body from 0 to 1; people of whom less is visible get the occlusion 3.

    Returns:
        The folder with the numbers of frames, and of kept and ignored labels.

    Raises:
        InputError: There are no boxes, or a folder is that of a stored sequence or a run.
    """
    labelled, out = labelled_pictures(Path(source), min_visibility), Path(out)
    counts, listed = np.zeros(3, np.int64), dict[str, list[str]]()
    for each in in_turn(labelled):
        split, _, name = split_and_name(Path(each.sequence.source["path"])).partition("/")
        reject_sealed(out / split)
        length = each.truth.length
        found = [each.people(k) for k in range(1, length + 1)]
        lines = (line for k, people in enumerate(found) for line in _lines(each, people, k))
        write_file(out / split / f"label_02/{name}.txt", "".join(lines).encode())
        listed.setdefault(split, []).append(f"{name} empty 000000 {length:06d}\n")
        hidden = sum(int(people.ignored.sum()) for people in found)
        counts += [length, sum(len(people.id) for people in found) - hidden, hidden]
    for split, lengths in listed.items():
        write_file(out / split / f"evaluate_tracking.seqmap.{split}", "".join(lengths).encode())
    frames, kept, ignored = counts.tolist()
    return Exported(out, frames, kept, ignored, min_visibility)


def _lines(labelled: LabelledPictures, people: PicturePeople, number: int) -> Iterator[str]:
    """Yields the line of each person in a picture. number: of the frame, from 0."""
    far = np.subtract([*labelled.size, *labelled.size], 1)
    box = np.clip(people.part - 0.5, 0, far)
    outside, occluded = levels(labelled.truth.truncation, people)
    for row, solid in enumerate(solids(labelled, people).tolist()):
        cells = " ".join(f"{value:.2f}" for value in (*box[row].tolist(), *solid[1:]))
        yield f"{number} {people.id[row]} Pedestrian {outside[row]} {occluded[row]} {solid[0]:.2f} {cells}\n"


def levels(truncation: Array | None, people: PicturePeople) -> tuple[Ints, Ints]:
    """Returns the levels of truncation and of occlusion (N,). truncation (R,): of the rows of the truth, or None."""
    outside = np.zeros(len(people.id)) if truncation is None else truncation[people.rows]
    hidden = 1 - people.visibility / np.maximum(1 - outside, 1e-9)
    occluded = np.searchsorted(OCCLUDED, hidden, "left")
    return np.searchsorted(TRUNCATED, outside, "right"), np.where(people.ignored, HIDDEN, occluded)


def solids(labelled: LabelledPictures, people: PicturePeople) -> Array:
    """Returns alpha, height, width, length, x, y, z and rotation_y (N, 8) of people; KITTI's "unknown" without a
    pinhole camera."""
    truth, camera, rows = labelled.truth, labelled.sequence.camera, people.rows
    if labelled.cameras and len(rows):
        camera = labelled.cameras[int(truth.frame[rows[0]]) - 1]
    known = truth.pos is not None and truth.height is not None and truth.heading is not None
    if not known or camera is None or camera.kind != "pinhole":
        return np.tile(UNKNOWN, (len(rows), 1))
    assert truth.pos is not None
    assert truth.height is not None
    assert truth.heading is not None
    z = np.zeros(len(rows)) if truth.z is None else truth.z[rows]
    height, heading = truth.height[rows], truth.heading[rows]
    place = (np.column_stack([truth.pos[rows], z]) - camera.position) @ camera.rotation.T
    ahead = np.column_stack([np.cos(heading), np.sin(heading), np.zeros(len(rows))]) @ camera.rotation.T
    turn = np.arctan2(-ahead[:, 2], ahead[:, 0])
    alpha = np.angle(np.exp(1j * (turn - np.arctan2(place[:, 0], place[:, 2]))))
    sizes = [height, SHOULDER_SHARE * height, DEPTH_SHARE * height]
    return np.column_stack([alpha, *sizes, place, turn])
