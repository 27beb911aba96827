"""Tidy tables of a run or a truth: people, people_summary, groups, members, events, crossings, counts, and their files.

A tidy table has one observation a row. The names of its columns end with their unit: `x_m`, `speed_m_s`, `t_s`; what is
in the image is in px. Unknown values are empty cells. Groups and members are those that the run or truth states in each
frame; nothing is derived anew, so the tables agree with it.

All tables are written as CSV or Parquet; the people also as texts of positions on the ground in m. TrajNet++: a JSON
object a line, for each person a scene that spans the frames of the person, then a track for each person and frame.
PedPy and JuPedSim: lines `id frame x y`, apart by tabs, below comments with the frame rate and the names of columns.

Crossings are those of lines and zones (tracking.export.places), counts are per interval (interval_counts).
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping
from collections.abc import Sequence as Series
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from scenarios.errors import reject
from sim.arrays import joined, no_ids
from sim.store.atomic import write_file
from sim.store.own_files import refuse_foreign_file
from sim.store.tables import parquet_bytes
from sim.truth.velocities import differentiate
from sim.types import Array, Bools, GroupEvent, Groups, Ints, Tracks, Truth
from tracking.export.interval_counts import CountedRows, PlaceCounts, interval_counts
from tracking.export.places import NOWHERE, Places
from tracking.export.table_options import TableOptions
from tracking.grouping.short_groups import LeftOut, concerns, lasting_groups, only, only_ids
from tracking.keyword_options import documented

if TYPE_CHECKING:
    import pyarrow

Form = Literal["csv", "parquet", "trajnet", "pedpy"]
# name and beginning of the texts of people; of nobody, one is empty
TEXTS = {
    "trajnet": ("people.ndjson", rb'\{"scene": \{"id": 0, "p": \d+, "s": \d+, "e": \d+, "fps": [0-9.e+-]+\}\}\n|\Z'),
    "pedpy": ("people.txt", rb"# framerate: \S+\n# id\tframe\tx/m\ty/m\n"),
}
BOX = ("box_left_px", "box_top_px", "box_width_px", "box_height_px")


@dataclass(frozen=True, eq=False)
class TidyTable:
    """One tidy table; `to_arrow` and `to_pandas` give it to other libraries.

    Attributes:
        columns: The values of all rows by name of the column: an array, nan if unknown, or a list of texts or id lists.
    """

    columns: Mapping[str, Any]

    def to_arrow(self) -> pyarrow.Table:
        """Returns the table as a pyarrow.Table, which polars reads with `polars.from_arrow`; nan becomes null."""
        import pyarrow as pa

        lists = {name: pa.list_(pa.int64()) for name, v in self.columns.items() if not isinstance(v, np.ndarray)}
        kinds = dict.fromkeys(self.columns) | lists | dict.fromkeys(("kind", "place", "direction"), pa.string())
        return pa.table({name: pa.array(v, kinds[name], from_pandas=True) for name, v in self.columns.items()})

    def to_pandas(self) -> Any:
        """Returns the table as a data frame of pandas, which must be installed."""
        return self.to_arrow().to_pandas()


@dataclass(frozen=True, eq=False)
class TidyTables:
    """The tidy tables of one sequence.

    Attributes:
        people: One row per person and frame.
        people_summary: One row per person.
        groups: One row per group.
        members: One row per group, person, and interval of frames in which the person belongs to the group.
        events: One row per event.
        crossings: One row per person and passage of a line or of the edge of a zone.
        counts: One row per interval of time.
        left_out: Short groups and their events, which are in none of the tables.
    """

    people: TidyTable
    people_summary: TidyTable
    groups: TidyTable
    members: TidyTable
    events: TidyTable
    crossings: TidyTable
    counts: TidyTable
    left_out: LeftOut

    def named(self) -> dict[str, TidyTable]:
        """Returns the tables by name."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name != "left_out"}


@dataclass(frozen=True, eq=False)
class _Rows:
    """What a run and a truth have in common: R rows of people, G rows of groups in frames, events."""

    fps: float
    listed: Ints  # frames that were observed; frames between them break no interval
    unit: str  # of positions: "m" or "px"
    metre: float  # length of 1 m in this unit, nan if unknown
    # people, (R,) or (R, D), sorted by (frame, id); vel is nan, group -1 where unknown
    frame: Ints
    id: Ints
    group: Ints
    pos: Array
    vel: Array
    sigma: Array  # (R,) standard deviation of the position on an axis
    seen: Bools  # (R,) False for people who are only predicted
    heading: Array | None  # (R,) rad, None: the direction of vel
    box: Array | None  # (R, 4) px
    score: Array | None
    more: Mapping[str, Array | Ints]  # visibility, truncation and subgroup (R,), by name, those that are known
    groups: Series[Groups] | None  # of each listed frame; None: not labelled
    events: Series[GroupEvent]
    unobserved: Series[tuple[int, int]] = ()  # first and last frames of stretches in which people are predicted only

    def seconds(self, frame: Any) -> Any:
        return (frame - 1) / self.fps


@documented(TableOptions)
def run_tables(
    tracks: Series[Tracks], fps: float, places: Places = NOWHERE, *, px_per_m: float = math.nan,
    unobserved: Series[tuple[int, int]] = (), **options: Any,
) -> TidyTables:  # fmt: skip
    """Returns the tidy tables of a run. tracks: one Tracks per frame. For tracks of groups the people tables are empty.

    places: lines and zones by name; `counts`, `crossings` and `people_summary` tell who is there. px_per_m: scale of
    tracks in the image. unobserved: first and last frames of stretches that a live run lost. Frames between those of
    the tracks were not observed, either.
    """
    from sim.store.track_files import flatten

    rows = flatten(list(tracks))
    people = slice(0, 0) if rows.unit == "group" else slice(None)
    known = any(t.groups is not None for t in tracks)
    image = rows.plane == "image"
    # Tracks.of_points gives the identity where the covariance is unknown.
    told = (rows.cov[people] != np.eye(rows.cov.shape[1])).any(axis=(1, 2))
    variance = np.where(told, (rows.cov[people, 0, 0] + rows.cov[people, 1, 1]) / 2, np.nan)
    return _tables(
        _Rows(
            fps, np.array([t.index for t in tracks], np.int64), "px" if image else "m", px_per_m if image else 1.0,
            rows.frame[people], rows.id[people], rows.group[people], rows.pos[people], rows.vel[people],
            np.sqrt(np.maximum(variance, 0.0)), rows.seen[people], None,
            None if rows.boxless.all() else rows.box[people], rows.score[people], {},
            [t.groups or Groups.none() for t in tracks] if known else None, [e for t in tracks for e in t.events],
            unobserved,
        ),
        places, TableOptions(**options),
    )  # fmt: skip


@documented(TableOptions)
def truth_tables(truth: Truth, places: Mapping[str, Any] | None = None, **options: Any) -> TidyTables:
    """Returns the tidy tables of a truth, in m if it has positions on the ground, else of the boxes' centres in px.

    places: lines and zones by name, as of `TrackingRun.tables`; None means neither.
    """
    there = {name: np.asarray(corners, float) for name, corners in (places or {}).items()}
    pos, vel, unit, metre = truth.pos, truth.vel, "m", 1.0
    if pos is None:
        assert truth.box is not None
        pos, unit, metre = truth.box[:, :2] + truth.box[:, 2:] / 2, "px", truth.px_per_m
    if vel is None:
        vel = differentiate(truth.frame, truth.id, pos, truth.fps)
    groups = truth.groups if truth.groups is not None else truth.groups_px
    listed = np.arange(1, truth.length + 1)
    if groups is not None and truth.labelled is not None and truth.labelled.any():
        listed = listed[truth.labelled]
        groups = tuple(groups[k - 1] for k in listed.tolist())
    more = {
        "visibility": None if truth.box is None else truth.visibility, "truncation": truth.truncation,
        "subgroup": truth.subgroup,
    }  # fmt: skip
    return _tables(
        _Rows(
            truth.fps, listed, unit, metre, truth.frame, truth.id, truth.group, pos, vel, np.full(len(pos), np.nan),
            np.ones(len(pos), bool),
            truth.heading, truth.box, None, {name: values for name, values in more.items() if values is not None},
            groups, truth.events or (),
        ),
        there, TableOptions(**options),
    )  # fmt: skip


def write_tables(tables: TidyTables, folder: Path, form: Form, facts: Mapping[str, Any]) -> list[Path]:
    """Writes each table as folder/NAME.csv or .parquet, or the people alone as one text; returns the paths.

    form: "csv", "parquet" or a form of text. facts: "fps" and more, the metadata of Parquet files. Raises InputError if
    a foreign file would be replaced, or if a text is asked for but positions are in px.
    """
    if form in TEXTS:
        name, beginning = TEXTS[form]
        got, expected = "people in the image, px", "positions on the ground, m"
        reject("x_m" not in tables.people.columns, folder, got, expected, "track with --camera, or from points")
        body = (trajnet_text if form == "trajnet" else pedpy_text)(tables, facts["fps"])
        _refuse_foreign(folder / name, beginning)
        write_file(folder / name, body.encode())
        return [folder / name]
    found = {folder / f"{name}.{form}": table.to_arrow() for name, table in tables.named().items()}
    for path, table in found.items():
        # The first columns have the same names for runs and truths, in m and in px.
        _refuse_foreign(path, re.escape(",".join(table.column_names[:2]) + ",").encode() if form == "csv" else None)
    for path, table in found.items():
        write_file(path, _csv(table) if form == "csv" else parquet_bytes(table, facts))
    return list(found)


def _refuse_foreign(path: Path, beginning: bytes | None) -> None:
    """Raises InputError if there is a file of another program; of a text of ours the beginning (a pattern) is known."""
    if beginning is not None and path.is_file():
        with path.open("rb") as file:
            if re.match(beginning, file.read(1000)):
                return
    refuse_foreign_file(path)


def trajnet_text(tables: TidyTables, fps: float) -> str:
    """Returns people on the ground as TrajNet++: the scene of each person, then the track of each person and frame."""
    stays = tables.people_summary.columns
    spans = zip(*(np.asarray(stays[name]).tolist() for name in ("id", "start_frame", "end_frame")), strict=True)
    scenes = ({"scene": {"id": k, "p": p, "s": s, "e": e, "fps": fps}} for k, (p, s, e) in enumerate(spans))
    tracks = ({"track": {"f": f, "p": p, "x": round(x, 4), "y": round(y, 4)}} for f, p, x, y in _places(tables))
    return "".join(f"{line}\n" for line in map(json.dumps, (*scenes, *tracks)))


def pedpy_text(tables: TidyTables, fps: float) -> str:
    """Returns people on the ground as a text of PedPy and JuPedSim."""
    rows = "".join(f"{p}\t{f}\t{x:.4f}\t{y:.4f}\n" for f, p, x, y in _places(tables))
    return f"# framerate: {fps:g}\n# id\tframe\tx/m\ty/m\n{rows}"


def _places(tables: TidyTables) -> Iterator[tuple[int, int, float, float]]:
    columns = tables.people.columns
    return zip(*(columns[name].tolist() for name in ("frame", "id", "x_m", "y_m")), strict=True)


def _csv(table: pyarrow.Table) -> bytes:
    import pyarrow as pa
    from pyarrow import csv

    columns = list(table.columns)
    for k, column in enumerate(columns):
        if pa.types.is_list(column.type):
            columns[k] = pa.array([" ".join(map(str, ids)) for ids in column.to_pylist()], pa.string())
    sink = pa.BufferOutputStream()
    # pyarrow would quote the header.
    options = csv.WriteOptions(include_header=False, quoting_style="needed")
    csv.write_csv(pa.table(columns, names=table.column_names), sink, options)
    return (",".join(table.column_names) + "\n").encode() + bytes(sink.getvalue())


def _tables(rows: _Rows, places: Places, options: TableOptions) -> TidyTables:
    options.check()
    rows, left_out = _without_short_groups(rows, options.min_duration)
    # People may be labelled in frames whose groups are not.
    lost = [np.arange(first, last + 1) for first, last in rows.unobserved]
    observed = np.setdiff1d(np.union1d(rows.listed, rows.frame), np.concatenate([np.zeros(0, np.int64), *lost]))
    of_people = CountedRows(
        rows.fps, observed, rows.frame, rows.id, rows.pos, rows.sigma, rows.seen, rows.unit, rows.metre
    )
    counted = PlaceCounts(of_people, places, options)
    u = rows.unit
    speed = np.hypot(rows.vel[:, 0], rows.vel[:, 1])
    # Who stands has no direction of motion.
    moving = np.where(speed > 0, np.arctan2(rows.vel[:, 1], rows.vel[:, 0]), np.nan)
    heading = moving if rows.heading is None else rows.heading
    axes = {f"{axis}_{u}": rows.pos[:, k] for k, axis in zip(range(rows.pos.shape[1]), "xyz", strict=False)}
    people = {"frame": rows.frame, "t_s": rows.seconds(rows.frame), "id": rows.id, **axes}
    people |= {f"speed_{u}_s": speed, "heading_rad": heading}
    people |= {} if rows.box is None else {name: rows.box[:, k] for k, name in enumerate(BOX)}
    people |= {} if rows.score is None else {"score": rows.score}
    people |= rows.more
    people |= {} if rows.groups is None else {"group": rows.group}
    number, group, size, members = _group_rows(rows)
    of_groups = None if rows.groups is None else {"listed": rows.listed, "frame": number, "id": group}
    starts = np.array([e.start for e in rows.events], np.int64)
    return TidyTables(
        TidyTable(people), TidyTable(_summary(rows, speed, members) | counted.dwell(np.unique(rows.id))),
        TidyTable(_groups(rows, number, group, size)), TidyTable(_intervals(rows, *members)), TidyTable(_events(rows)),
        TidyTable(counted.crossings()), TidyTable(interval_counts(of_people, counted, of_groups, starts)), left_out,
    )  # fmt: skip


def _without_short_groups(rows: _Rows, seconds: float) -> tuple[_Rows, LeftOut]:
    if rows.groups is None or not seconds:
        return rows, LeftOut(seconds)
    kept, number = lasting_groups(rows.groups, rows.fps, seconds)
    names = set(kept.tolist())
    events = [e for e in rows.events if concerns(e, names)]
    left_out = LeftOut(seconds, number - len(kept), number, len(rows.events) - len(events), len(rows.events))
    group = only_ids(rows.group, kept)
    return replace(rows, group=group, groups=[only(g, kept) for g in rows.groups], events=events), left_out


def _group_rows(rows: _Rows) -> tuple[Ints, Ints, Array, tuple[Ints, Ints, Ints]]:
    """Returns frame, id and size of each group in each frame (G,), and (frame, group, id) of each member (M,)."""
    every = list(zip(rows.listed.tolist(), rows.groups or (), strict=False))
    frame = np.repeat(np.array([k for k, _ in every], np.int64), [len(g.id) for _, g in every])
    group, size = joined((g.id for _, g in every), kind=np.int64), joined(g.size for _, g in every)
    listed = [(k, name, m) for k, g in every for name, m in zip(g.id.tolist(), g.members, strict=False)]
    counts = [len(m) for *_, m in listed]
    when, name = (np.repeat(np.array([item[k] for item in listed], np.int64), counts) for k in (0, 1))
    return frame, group, size, (when, name, joined((m for *_, m in listed), kind=np.int64))


def _span(rows: _Rows, first: Ints, last: Ints) -> dict[str, Any]:
    """Returns the columns of intervals of frames, both ends inclusive: frames and seconds."""
    times = {"t_start_s": rows.seconds(first), "t_end_s": rows.seconds(last)}
    return {"start_frame": first, "end_frame": last, **times}


def _spans(rows: _Rows, frame: Ints, id: Ints) -> tuple[Ints, Ints, Ints, dict[str, Any]]:
    """Returns the order of rows by (id, frame), the number of each one's id in it, the ids, and their columns."""
    order = np.lexsort((frame, id))
    ids, first, count = np.unique(id[order], return_index=True, return_counts=True)
    spans = _span(rows, frame[order][first], frame[order][first + count - 1])
    return order, np.repeat(np.arange(len(ids)), count), ids, {**spans, "frames": count}


def _summary(rows: _Rows, speed: Array, members: tuple[Ints, Ints, Ints]) -> dict[str, Any]:
    order, who, people, spans = _spans(rows, rows.frame, rows.id)
    step = np.zeros(len(order))
    step[1:] = np.where(np.diff(who) == 0, np.hypot(*np.diff(rows.pos[order, :2], axis=0).T), 0.0)
    known = np.isfinite(speed[order])
    total = np.bincount(who, np.where(known, speed[order], 0.0), len(people))
    number = np.bincount(who, known, len(people))
    belongs: dict[int, set[int]] = {}
    for name, person in np.unique(np.stack(members[1:], axis=1), axis=0).tolist():
        belongs.setdefault(person, set()).add(name)
    return {
        "id": people, **spans,
        f"path_{rows.unit}": np.bincount(who, np.nan_to_num(step), len(people)),
        f"speed_mean_{rows.unit}_s": np.where(number > 0, total / np.maximum(number, 1), np.nan),
        "groups": [sorted(belongs.get(person, ())) for person in people.tolist()],
    }  # fmt: skip


def _groups(rows: _Rows, frame: Ints, group: Ints, size: Array) -> dict[str, Any]:
    order, who, names, spans = _spans(rows, frame, group)
    first = np.flatnonzero(np.diff(who, prepend=-1))
    most = np.maximum.reduceat(size[order], first) if len(first) else np.zeros(0)
    mean = np.bincount(who, size[order], len(names)) / spans["frames"]
    return {"id": names, **spans, "size_mean": mean, "size_max": most}


def _intervals(rows: _Rows, frame: Ints, group: Ints, id: Ints) -> dict[str, Any]:
    order = np.lexsort((frame, id, group))
    frame, group, id = frame[order], group[order], id[order]
    place = np.searchsorted(rows.listed, frame)
    new = np.ones(len(frame), bool)
    new[1:] = (np.diff(group) != 0) | (np.diff(id) != 0) | (np.diff(place) != 1)
    first = np.flatnonzero(new)
    last = np.append(first[1:], len(frame)) - 1 if len(first) else no_ids()
    return {"group": group[first], "id": id[first], **_span(rows, frame[first], frame[last])}


def _events(rows: _Rows) -> dict[str, Any]:
    events = sorted(rows.events, key=lambda e: (e.start, e.end, e.kind, e.members))
    start, end = (np.array([getattr(e, name) for e in events], np.int64) for name in ("start", "end"))
    place = np.array([e.pos[:2] for e in events], np.float64).reshape(-1, 2)
    ids = {name: [list(map(int, getattr(e, name))) for e in events] for name in ("members", "before", "after")}
    return {
        "kind": [e.kind for e in events], **_span(rows, start, end), **ids,
        f"x_{rows.unit}": place[:, 0], f"y_{rows.unit}": place[:, 1],
    }  # fmt: skip
