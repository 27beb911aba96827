"""Scores of a user's own arrays: one row for each person and frame on either side, no files and no types of ours."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sim.types import Groups, Plane, Tracks, Truth
from tracking.grouping.grouped_tracks import derive
from tracking.scoring.evaluation import Scores, Similarity, evaluate
from tracking.scoring.groups import GroupMatch

COLUMNS = {"frame": (), "id": (), "pos": (2,), "box": (4,), "group": ()}
PERSON_HEIGHT = 1.7  # m, what the median box stands for

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
    """Every score of the catalogue, from two tables of columns with a row for each person in each frame.

    frame (R,) from 1 on and id (R,), whole numbers; pos (R, 2) on the ground in m, or box (R, 4) left, top, width,
    height in px, or both; group (R,), -1 alone, where known. Without groups in the truth only people are scored;
    without groups in the tracks these get them by the baseline rule. Merges, splits, crossings and queues are measured
    on both sides, from groups and places. px_per_m: of boxes alone; where absent their median height is 1.7 m.
    ValueError for wrong input.
    """
    if not (np.isfinite(fps) and fps > 0):
        raise ValueError(f"fps: got {fps}, expected a number above 0")
    true, est = _table(truth, "truth"), _table(tracks, "tracks")
    sides = [side for side in (true, est) if len(side["frame"])]
    plane: Plane = "ground" if all(side["pos"] is not None for side in sides) else "image"
    if plane == "image" and any(side["box"] is None for side in sides):
        raise ValueError("got pos on one side and box on the other, expected one of them on both")
    length = max((int(side["frame"][-1]) for side in sides), default=0)
    scale = _scale(true["box"]) if px_per_m is None else px_per_m
    made, answers = _truth(true, length, fps, scale, plane), _answers(est, length, fps, scale, plane)
    return evaluate(made, answers, similarity=similarity, group_match=group_match)


def _table(columns: Mapping[str, ArrayLike], side: str) -> Table:
    """The columns as arrays of the right kind, rows sorted by frame and id; None where there is none."""
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
    return float("nan") if box is None or not len(box) else float(np.median(box[:, 3])) / PERSON_HEIGHT


def _answers(table: Table, length: int, fps: float, px_per_m: float, plane: Plane) -> list[Tracks]:
    """The rows as tracks of frames 1 … length, with shapes and events of the groups that the column tells, if any."""
    box, group, rows = table["box"], table["group"], len(table["frame"])
    pos = table["pos"] if plane == "ground" else box[:, :2] + box[:, 2:] / 2
    label = np.full(rows, -1, np.int64) if group is None else group
    nobody = Groups.none() if group is not None and (label < 0).all() else None
    cuts = np.searchsorted(table["frame"], np.arange(1, length + 2)).tolist()

    def at(index: int) -> Tracks:
        r, n = slice(cuts[index - 1], cuts[index]), cuts[index] - cuts[index - 1]
        return Tracks(
            index, (index - 1) / fps, plane, "person", table["id"][r], label[r], pos[r], np.full((n, 2), np.nan),
            np.full((n, 4, 4), np.nan), None if box is None else box[r], np.ones(n), nobody,
        )  # fmt: skip

    found = [at(index) for index in range(1, length + 1)]
    return found if group is None or not rows else derive(found, fps, px_per_m)


def _truth(table: Table, length: int, fps: float, px_per_m: float, plane: Plane) -> Truth:
    """The truth of a table; labelled where it has a group column."""
    frame, group, rows = table["frame"], table["group"], len(table["frame"])
    truth = Truth(
        "arrays", fps, length, px_per_m, frame, table["id"], np.full(rows, -1) if group is None else group,
        table["pos"], None, table["box"], np.ones(rows), labelled=np.full(length, group is not None),
    )  # fmt: skip
    if group is None:
        return truth
    told = _answers(table, length, fps, px_per_m, plane)
    groups = tuple(t.groups or Groups.none() for t in told)
    events = tuple(replace(e, emitted=None) for t in told for e in t.events)
    return truth.replace(events=events, **{"groups" if plane == "ground" else "groups_px": groups})
