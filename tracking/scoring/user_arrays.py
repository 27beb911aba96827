"""`score_arrays`: scores of your own arrays, one row per person and frame on each side, without files or our types.

Columns are frame, id, position or box, and group. They are checked, turned into a `Truth` and `Tracks`, and scored as
those.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from scenarios.limits import COORDINATE, DETECTIONS, FRAME_RATES, FRAMES, is_number
from sim.types import GroupEvent, Groups, Ints, Plane, Tracks, Truth
from tracking.grouping.grouped_tracks import derive, with_groups
from tracking.scoring.annotated_frames import annotated_frames
from tracking.scoring.evaluation import Scores, evaluate
from tracking.scoring.groups import GroupMatch
from tracking.scoring.misreading import likely_misreading
from tracking.scoring.people import Similarity

# By the name of a column: shape of one row; least and greatest value, as in files. One number in a row is a whole one.
COLUMNS: dict[str, tuple[tuple[int, ...], float, float]] = {
    "frame": ((), 1, FRAMES),
    "id": ((), 0, 2**53),
    "pos": ((2,), -COORDINATE, COORDINATE),
    "box": ((4,), -COORDINATE, COORDINATE),
    "group": ((), -1, 2**53),
}
PERSON_HEIGHT = 1.7  # m: assumed height of the median box
MEMORY = 10.0  # s: groups and events depend on what was there at most that long before

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
    """Returns every score of the catalogue for a truth and tracks given as tables of columns.

    A table is a mapping from column names to arrays of R rows, one row per person and frame, in any order. The columns
    are: frame (R,), whole numbers from 1; id (R,), whole numbers; pos (R, 2), x and y on the ground in m; box (R, 4),
    left, top, width and height in px; group (R,), group id, -1 for a person alone. Required are frame, id, and pos or
    box (or both). The bounds are those of files: ids from 0, coordinates from -1e6 to 1e6, width and height above 0, at
    most 5000 rows per frame, frame numbers up to 1,000,000.

    Groups are compared on the ground if both tables have pos, else in the image. If the truth has no group column, only
    people are scored. If the tracks have none, the default grouping finds their groups. Events of both sides are
    derived from groups and positions. If only some frames are labelled (every 10th, say), only these are scored. Warns
    if hardly any tracked person matches a true one.

    Args:
        truth: the table of the labelled people.
        tracks: the table of the tracked people.
        fps: frames per second, 0.01 to 1000.
        px_per_m: pixels per metre, used in the image only. None assumes that the median true box is 1.7 m high.
        similarity: compares people by IoU of "boxes" or by distance on the "ground" or in the "image". None compares on
            the ground if both tables have pos, else by boxes.
        group_match: matches groups by IoU of their hulls ("hull") or Jaccard index of their members ("members").

    Returns:
        `Scores`, a mapping from key to value; a score that cannot be computed is nan.

    Raises:
        ValueError: a column is unknown, missing, of a wrong shape, or holds a value out of bounds; one table has pos
            only and the other box only; or an id occurs twice in one frame.
        InputError: groups must be derived in the image, and px_per_m is 0 or less, or is None without any true box.
    """
    low, high = FRAME_RATES
    if not is_number(fps, low, high):
        raise ValueError(f"fps: got {fps!r}, expected a number from {low:g} to {high:g}")
    true, est = _table(truth, "truth"), _table(tracks, "tracks")
    filled = [table for table in (true, est) if len(table["frame"])]
    plane: Plane = "ground" if all(table["pos"] is not None for table in filled) else "image"
    if plane == "image" and any(table["box"] is None for table in filled):
        raise ValueError("got pos on one side and box on the other, expected one of them on both")
    length = max((int(table["frame"][-1]) for table in filled), default=0)
    scale = _scale(true["box"]) if px_per_m is None else px_per_m
    made = _truth(true, length, fps, scale, plane)
    annotated = annotated_frames(made).frames
    known = np.flatnonzero(annotated) if annotated[est["frame"]].all() else np.arange(1, length + 1)
    given = _tracks(est, known, fps, scale, plane, true["group"] is not None)
    doubt = likely_misreading(made, given, files=False)
    if doubt:
        warnings.warn(doubt, stacklevel=2)
    return evaluate(made, given, similarity=similarity, group_match=group_match)


def _table(columns: Mapping[str, ArrayLike], side: str) -> Table:
    """Returns all columns as arrays, sorted by frame, then id, None for a missing one. Raises ValueError if invalid."""
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
    distinct, count = np.unique(frame, return_counts=True)
    if (count > DETECTIONS).any():
        most = int(np.argmax(count))
        raise ValueError(f"{side}: got {count[most]} rows of frame {distinct[most]}, expected at most {DETECTIONS}")
    order = np.lexsort((id, frame))
    return {name: None if values is None else values[order] for name, values in table.items()}


def _column(given: ArrayLike, name: str, side: str) -> Any:
    values, (shape, low, high) = np.asarray(given), COLUMNS[name]
    values = values if values.size else np.zeros((0, *shape))
    expected = f"{'' if shape else 'whole '}numbers from {low:g} to {high:,}"
    expected += ", boxes with width and height above 0" if name == "box" else ""
    if values.ndim == 0 or values.shape[1:] != shape:
        got, expected = f"{name} of shape {values.shape}", str(("rows", *shape)).replace("'", "")
    elif values.dtype.kind not in "iuf":
        got = f"{values.ravel().tolist()[0]!r} in {name}"
    else:
        good = (values >= low) & (values <= high) & (shape != () or values == np.floor(values))
        if name == "box":
            good[:, 2:] &= values[:, 2:] > 0
        if good.all():
            return values.astype(float if shape else np.int64)
        got = f"{values[~good][0]} in {name}"
    raise ValueError(f"{side}: got {got}, expected {expected}")


def _scale(box: Any) -> float:
    return float("nan") if box is None or not len(box) else float(np.median(box[:, 3])) / PERSON_HEIGHT


def _tracks(table: Table, known: Ints, fps: float, px_per_m: float, plane: Plane, grouped: bool) -> list[Tracks]:
    """Returns `Tracks` of the known frames (K,), evenly spaced in time, without frames in which nothing can change."""
    box, group, rows = table["box"], table["group"], len(table["frame"])
    pos = table["pos"] if plane == "ground" else box[:, :2] + box[:, 2:] / 2
    label = np.full(rows, -1, np.int64) if group is None else group
    rate = fps / float(np.diff(known).mean()) if len(known) > 1 else fps
    frame: Ints = table["frame"]
    turns = np.searchsorted(known, frame) + 1
    live = _live_frames(turns, len(known), rate)
    first, after = (np.searchsorted(turns, live, side).tolist() for side in ("left", "right"))

    def at(index: int, low: int, high: int) -> Tracks:
        r, n = slice(low, high), high - low
        return Tracks(
            index, (index - 1) / rate, plane, "person", table["id"][r], label[r], pos[r], np.full((n, 2), np.nan),
            np.full((n, 4, 4), np.nan), None if box is None else box[r], np.ones(n),
            Groups.none() if group is not None and (label[r] < 0).all() else None,
        )  # fmt: skip

    found = [at(*each) for each in zip(live.tolist(), first, after, strict=True)]
    if group is not None and rows:
        found = derive(found, rate, px_per_m)
    elif grouped:
        found = list(with_groups(found, rate, px_per_m))
    return [_in_frames(t, known, fps) for t in found]


def _in_frames(tracks: Tracks, known: Ints, fps: float) -> Tracks:
    index = int(known[tracks.index - 1])

    def moved(event: GroupEvent) -> GroupEvent:
        start, end = (int(known[frame - 1]) for frame in (event.start, event.end))
        return replace(event, start=start, end=end, emitted=event.emitted and int(known[event.emitted - 1]))

    return tracks.replace(index=index, t=(index - 1) / fps, events=tuple(map(moved, tracks.events)))


def _live_frames(frame: Ints, length: int, fps: float) -> Ints:
    """Returns the frames with rows, those up to 10 s after each, 1 and `length`: the others decide nothing."""
    rows = np.cumsum(np.bincount(frame, minlength=length + 1))
    reach = int(np.ceil(MEMORY * fps)) + 1
    live = rows > np.concatenate([np.zeros(reach), rows])[: length + 1]
    live[[1, length] if length else []] = True
    return np.flatnonzero(live)


def _truth(table: Table, length: int, fps: float, px_per_m: float, plane: Plane) -> Truth:
    frame, group, rows = table["frame"], table["group"], len(table["frame"])
    truth = Truth(
        "arrays", fps, length, px_per_m, frame, table["id"], np.full(rows, -1) if group is None else group,
        table["pos"], None, table["box"], np.ones(rows), labelled=np.zeros(length, bool),
    )  # fmt: skip
    if group is None:
        return truth
    annotated = annotated_frames(truth).frames
    derived = _tracks(table, np.flatnonzero(annotated), fps, px_per_m, plane, True)
    nobody = Groups.none()
    by_frame = {t.index: t.groups or nobody for t in derived}
    groups = tuple(by_frame.get(index, nobody) for index in range(1, length + 1))
    events = tuple(replace(e, emitted=None) for t in derived for e in t.events)
    return truth.replace(
        labelled=annotated[1:], events=events, **{"groups" if plane == "ground" else "groups_px": groups}
    )
