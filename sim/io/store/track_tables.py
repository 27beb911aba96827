"""The exact tables of a run, tracks.parquet and groups.parquet, from one tracker's tracks and back, with checks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError
from scenarios.limits import FRAME_RATES, FRAMES
from sim.arrays import repeated_ids
from sim.io.files import tables
from sim.io.files.tables import Column, StoredTable, table_bytes
from sim.io.store.group_files import AXES, read_groups
from sim.io.store.run_seal import EXACT
from sim.io.store.truth_files import BOX, scores_or_ones
from sim.types import Array, Groups, Ints, Tracks

UNITS = ("person", "group")
PLANES = ("ground", "space", "image")


@dataclass(frozen=True)
class RunRows:
    """The tracks of all frames of one tracker, R rows in the order of frames."""

    # plane, unit: of all tracks
    plane: Any
    unit: Any
    frame: Any  # (R,) from the tracks' index, from 1
    # id, group (R,): of the track and of its group, -1 for alone. pos, vel (R, D) m or px (per s), D = 3 in the plane
    # "space", else 2.
    id: Any
    group: Any
    pos: Array
    vel: Array
    cov: Array  # (R, 2D, 2D) covariance of position and velocity
    box: Array  # (R, 4) left, top, width, height in px, nan in a frame without boxes
    boxless: Any  # (R,) True in such a frame
    score: Array  # (R,) 1 if the tracker gives none

    def reject_faults(self, file: object, remedy: str) -> None:
        """Raises InputError for the first fault, with its frame: a wrong id or group, or number."""
        for wrong, got, expected in self._checks():
            row = int(np.argmax(wrong)) if wrong.any() else None
            if row is not None:
                place = f"frame {self.frame[row]}, id {self.id[row]}"
                raise InputError(file=file, place=place, got=got, expected=expected, remedy=remedy)

    def _checks(self) -> Iterator[tuple[Any, str, str]]:
        yield self.id < 0, "a negative id", "ids from 0"
        yield repeated_ids(self.frame, self.id), "an id a second time in the frame", "unique ids in a frame"
        yield self.group < -1, "a group below -1", "groups from 0, or -1 for alone"
        if self.unit == "group":
            yield self.group != self.id, "a group that is not the id", "group equal to id where the unit is group"
        for name in ("pos", "score"):
            yield _rows_with(~np.isfinite(getattr(self, name))), f"NaN or infinity in {name}", "finite numbers"
        # nan means unknown.
        for name in ("vel", "cov"):
            yield _rows_with(np.isinf(getattr(self, name))), f"infinity in {name}", "finite numbers, or nan for unknown"
        box = ~np.isfinite(self.box).all(axis=1) & ~self.boxless
        yield box, "NaN or infinity in box", "a box, as others of the frame have"


def _rows_with(wrong: Any) -> Any:
    return wrong.reshape(len(wrong), int(np.prod(wrong.shape[1:]))).any(axis=1)


def flatten(every: list[Tracks]) -> RunRows:
    """Returns the rows of all frames of one tracker; without tracks none, in the plane "ground"."""
    kinds = {(t.plane, t.unit) for t in every}
    assert len(kinds) <= 1, f"a tracker stays in one plane and unit: {sorted(kinds)}"
    plane, unit = next(iter(kinds), ("ground", "person"))
    d = 3 if plane == "space" else 2
    counts = [len(t.id) for t in every]

    def join(parts: list[Any], empty: Any) -> Any:
        return np.concatenate([empty, *parts])

    ids = np.zeros(0, np.int64)
    no_box = [np.full((len(t.id), 4), np.nan) if t.box is None else t.box for t in every]
    return RunRows(
        plane, unit, np.repeat(np.array([t.index for t in every], np.int64), counts),
        join([t.id for t in every], ids), join([t.group for t in every], ids),
        join([t.pos for t in every], np.zeros((0, d))), join([t.vel for t in every], np.zeros((0, d))),
        join([t.cov for t in every], np.zeros((0, 2 * d, 2 * d))), join(no_box, np.zeros((0, 4))),
        np.repeat(np.array([t.box is None for t in every], bool), counts),
        join([scores_or_ones(t.score, len(t.id)) for t in every], np.zeros(0)),
    )  # fmt: skip


def _state(plane: str) -> list[str]:
    axes = AXES[:3] if plane == "space" else AXES[:2]
    return [*axes, *(f"v{a}" for a in axes)]


def track_table(rows: RunRows, every: list[Tracks], fps: float) -> bytes:
    """Returns tracks.parquet, a row per track and frame. rows: those of `every`, one Tracks per frame."""
    unit, state = "px" if rows.plane == "image" else "m", _state(rows.plane)
    values = np.concatenate([rows.pos, rows.vel], axis=1)
    units = [f"{unit}/s" if name.startswith("v") else unit for name in state]
    columns = [
        Column("frame", rows.frame),
        Column("id", rows.id),
        Column("group", rows.group),
        *(Column(name, values[:, k], u) for k, (name, u) in enumerate(zip(state, units, strict=True))),
        *(Column(name, rows.box[:, k], "px") for k, name in enumerate(BOX)),
        Column("score", rows.score),
        *(
            Column(f"cov_{a}_{b}", rows.cov[:, i, j], f"{units[i]} {units[j]}")
            for i, a in enumerate(state)
            for j, b in enumerate(state)
        ),
    ]
    facts = {
        "plane": rows.plane, "unit": rows.unit, "fps": fps, "first": every[0].index if every else 1,
        "frames": len(every), "boxless": [t.index for t in every if t.box is None],
        "derived": bool(every) and all(t.derived for t in every),
    }  # fmt: skip
    return table_bytes(columns, facts)


def pair_table(frame: Ints, a: Ints, b: Ints, probability: Array) -> bytes:
    """Returns pairs.parquet: how probable it is that two people belong together.

    frame (R,): from 1. a, b (R,): ids. probability (R,): 0 to 1.
    """
    return table_bytes(
        [Column("frame", frame), Column("a", a), Column("b", b), Column("probability", probability, "1")], {}
    )


def read_track_table(folder: Path) -> list[Tracks]:
    """Returns the tracks of tracks.parquet, with the groups of groups.parquet, without events."""
    table = tables.read_table(folder / EXACT)
    plane, unit = table.fact("plane"), table.fact("unit")
    table.reject(plane not in PLANES, "plane", repr(plane), "ground, space or image")
    table.reject(unit not in UNITS, "unit", repr(unit), "person or group")
    first, count, fps = table.count("first", FRAMES), table.count("frames", FRAMES), table.number("fps", *FRAME_RATES)
    boxless, derived = table.frames("boxless"), table.facts.get("derived") is True
    cuts, groups = table.cuts(first, count), _groups(folder / "groups.parquet", first, count)
    rows = _rows(table, plane, unit, boxless)
    found = []
    for k in range(count):
        index, r = first + k, slice(int(cuts[k]), int(cuts[k + 1]))
        box = None if index in boxless else rows.box[r]
        found.append(
            Tracks(
                index, (index - 1) / fps, plane, unit, rows.id[r], rows.group[r], rows.pos[r], rows.vel[r],
                rows.cov[r], box, rows.score[r], groups[k], derived=derived,
            )
        )  # fmt: skip
    return found


def _rows(table: StoredTable, plane: str, unit: str, boxless: set[int]) -> RunRows:
    state = _state(plane)
    d = len(state) // 2
    values, frame = table.floats(*state), table.ints("frame")
    cov = table.floats(*(f"cov_{a}_{b}" for a in state for b in state)).reshape(-1, 2 * d, 2 * d)
    rows = RunRows(
        plane, unit, frame, table.ints("id"), table.ints("group"), values[:, :d], values[:, d:], cov,
        table.floats(*BOX), np.isin(frame, list(boxless)), table.floats("score"),
    )  # fmt: skip
    rows.reject_faults(table.file, tables.REDO)
    return rows


def _groups(path: Path, first: int, count: int) -> list[Groups | None]:
    if not path.is_file():
        return [None] * count
    table = tables.read_table(path)
    stated = table.fact("first"), table.fact("frames")
    got, expected = f"groups of frames from {stated[0]}, {stated[1]} in all", f"from {first}, {count} in all"
    table.reject(stated != (first, count), "schema", got, expected)
    found = read_groups(table)
    for index, some in enumerate(found, first):
        fault = None if some is None else _group_fault(some)
        table.reject(fault is not None, f"frame {index}", str(fault), "unique ids from 0 and finite places")
    return found


def _group_fault(groups: Groups) -> str | None:
    if len(groups.id) and groups.id.min() < 0:
        return f"group {groups.id.min()}"
    if len(np.unique(groups.id)) != len(groups.id):
        return "a group a second time"
    places = [groups.pos, *groups.hull]
    return None if all(np.isfinite(place).all() for place in places) else "NaN or infinity in a place or hull"
