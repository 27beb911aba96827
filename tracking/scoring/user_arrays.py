"""`score_arrays`: scores of your own arrays, one row per person and frame on each side, without files or our types.

Columns are frame, id, position or box, and group. They are checked, turned into a `Truth` and `Tracks`, and scored as
those.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sim.types import Groups, Plane, Tracks, Truth
from tracking.grouping.grouped_tracks import derive
from tracking.scoring.evaluation import Scores, evaluate
from tracking.scoring.group_scores import GroupMatch
from tracking.scoring.people_comparison import Similarity

COLUMNS = {"frame": (), "id": (), "pos": (2,), "box": (4,), "group": ()}  # name: shape of one row
PERSON_HEIGHT = 1.7  # m: assumed height of the median box

Table = dict[str, Any]


def score_arrays(
    truth: Mapping[str, ArrayLike],
    tracks: Mapping[str, ArrayLike],
    *,
    fps: float,
    px_per_m: float | None = None,
    similarity: Similarity | None = None,
    group_match: GroupMatch = "hull",
) -> Scores:
    """Returns every score of the catalogue for a truth and tracks given as tables of columns, one row per person and
    frame.

    A table is a mapping from column names to arrays of R rows, in any order: frame (R,), whole numbers from 1; id (R,),
    whole numbers; pos (R, 2), x, y on the ground in m; box (R, 4): left, top, width, height in px; group (R,), group
    id, -1 alone. frame, id and one of pos and box are required. Groups are compared on the ground if both tables have
    pos, else in the image. A table whose columns have 0 rows fits both.

    Without a group column in the truth only people are scored. Without one in the tracks they get groups by the
    default grouping. Events of both sides (merges, splits, crossings, queues …) are derived from groups and positions.
    A score that cannot be computed is nan.

    fps: frames per second. px_per_m: pixels per metre, for boxes only; None takes the median height of the true boxes
    for 1.7 m. similarity: compares people by "boxes", "ground" or "image"; None: by boxes if both have them, else by
    positions. group_match: matches groups by "hull" or "members".

    Raises ValueError if a column is unknown, missing, of a wrong shape or not finite, if columns differ in length, if
    ids, frames or groups are not whole, if a frame is below 1, if fps is not a finite number above 0, if both tables
    lack a common kind of position or the one of `similarity`, or if an id occurs twice in one frame. Raises InputError
    if groups must be derived in the image and px_per_m is not above 0, or unknown because there are no true boxes.
    """
    if not (np.isfinite(fps) and fps > 0):
        raise ValueError(f"fps: got {fps}, expected a number above 0")
    true, est = _table(truth, "truth"), _table(tracks, "tracks")
    filled = [table for table in (true, est) if len(table["frame"])]
    plane: Plane = "ground" if all(table["pos"] is not None for table in filled) else "image"
    if plane == "image" and any(table["box"] is None for table in filled):
        raise ValueError("got pos on one side and box on the other, expected one of them on both")
    length = max((int(table["frame"][-1]) for table in filled), default=0)
    scale = _scale(true["box"]) if px_per_m is None else px_per_m
    made, tracks_of_frames = _truth(true, length, fps, scale, plane), _tracks(est, length, fps, scale, plane)
    return evaluate(made, tracks_of_frames, similarity=similarity, group_match=group_match)


def _table(columns: Mapping[str, ArrayLike], side: str) -> Table:
    """Returns a dict of all columns (frame, id, pos, box, group) as arrays, rows sorted by frame, then id; an optional
    column that is missing is None.

    columns: as given by the user. side ("truth" or "tracks") begins the error messages. Raises ValueError if a
    column is unknown or invalid, if frame or id is missing, or both pos and box, if the columns differ in length,
    or if a frame is below 1.
    """
    for name in columns:
        if name not in COLUMNS:
            raise ValueError(f"{side}: got the column {name!r}, expected some of {', '.join(COLUMNS)}")
    if not {"frame", "id"} <= set(columns) or not {"pos", "box"} & set(columns):
        raise ValueError(f"{side}: got {', '.join(columns) or 'nothing'}, expected frame, id, and pos or box")
    table: Table = {name: _column(columns[name], name, side) if name in columns else None for name in COLUMNS}
    frame, id = table["frame"], table["id"]
    for name, values in table.items():
        if values is not None and len(values) != len(frame):
            raise ValueError(f"{side}: got {len(values)} rows of {name}, expected {len(frame)}, as of frame")
    if len(frame) and frame.min() < 1:
        raise ValueError(f"{side}: got frame {frame.min()}, expected frames from 1 on: add to all of them")
    order = np.lexsort((id, frame))
    return {name: None if values is None else values[order] for name, values in table.items()}


def _column(given: ArrayLike, name: str, side: str) -> Any:
    """Returns one column as float64 (pos, box) or int64 (frame, id, group); empty input gives 0 rows of the right
    shape.

    given: the user's values; name: of the column; side ("truth" or "tracks") begins the error messages. Raises
    ValueError if the shape is wrong, a value is not finite, or a frame, id or group is not whole. Raises TypeError for
    values that are no numbers.
    """
    values, shape = np.asarray(given), COLUMNS[name]
    values = values if values.size else values.reshape(0, *shape)
    if values.shape[1:] != shape or values.ndim == 0:
        expected = ("rows", *shape)
        raise ValueError(f"{side}: got {name} of shape {values.shape}, expected ({', '.join(map(str, expected))})")
    if not np.isfinite(values).all():
        raise ValueError(f"{side}: got a {name} that is not finite, expected numbers")
    if shape:
        return values.astype(float)
    if not np.array_equal(values, values.astype(np.int64)):
        raise ValueError(f"{side}: got a {name} that is not whole, expected whole numbers")
    return values.astype(np.int64)


def _scale(box: Any) -> float:
    """Returns pixels per metre: the median height of the boxes divided by 1.7 m; nan if box is None or empty.

    box (R, 4): left, top, width, height in px.
    """
    return float("nan") if box is None or not len(box) else float(np.median(box[:, 3])) / PERSON_HEIGHT


def _tracks(table: Table, length: int, fps: float, px_per_m: float, plane: Plane) -> list[Tracks]:
    """Returns one `Tracks` of people per frame 1 … length, with velocities and covariances nan and scores 1; [] if
    length is 0.

    table: checked columns, sorted by frame; fps: frames per second; plane: "ground" takes pos, "image" the centres of
    the boxes. With a group column groups and events are derived from it, and px_per_m (px per metre) scales image
    positions. Then InputError is raised if the plane is "image", there are rows and px_per_m is not a finite number
    above 0.
    """
    box, group, rows = table["box"], table["group"], len(table["frame"])
    pos = table["pos"] if plane == "ground" else box[:, :2] + box[:, 2:] / 2
    label = np.full(rows, -1, np.int64) if group is None else group
    cuts = np.searchsorted(table["frame"], np.arange(1, length + 2)).tolist()

    def at(index: int) -> Tracks:
        r, n = slice(cuts[index - 1], cuts[index]), cuts[index] - cuts[index - 1]
        return Tracks(
            index, (index - 1) / fps, plane, "person", table["id"][r], label[r], pos[r], np.full((n, 2), np.nan),
            np.full((n, 4, 4), np.nan), None if box is None else box[r], np.ones(n),
            Groups.none() if group is not None and (label[r] < 0).all() else None,
        )  # fmt: skip

    found = [at(index) for index in range(1, length + 1)]
    return found if group is None or not rows else derive(found, fps, px_per_m)


def _truth(table: Table, length: int, fps: float, px_per_m: float, plane: Plane) -> Truth:
    """Returns the rows of the table as a truth of frames 1 … length; all frames are labelled if there is a group
    column, else none.

    table: checked columns, sorted by frame; fps: frames per second; px_per_m: px per metre. With a group column groups
    (on the ground or in the image, by `plane`) and events are derived from it. Then InputError is raised if the plane
    is "image", there are rows and px_per_m is not a finite number above 0.
    """
    frame, group, rows = table["frame"], table["group"], len(table["frame"])
    truth = Truth(
        "arrays", fps, length, px_per_m, frame, table["id"], np.full(rows, -1) if group is None else group,
        table["pos"], None, table["box"], np.ones(rows), labelled=np.full(length, group is not None),
    )  # fmt: skip
    if group is None:
        return truth
    derived = _tracks(table, length, fps, px_per_m, plane)
    groups = tuple(t.groups or Groups.none() for t in derived)
    events = tuple(replace(e, emitted=None) for t in derived for e in t.events)
    return truth.replace(events=events, **{"groups" if plane == "ground" else "groups_px": groups})
