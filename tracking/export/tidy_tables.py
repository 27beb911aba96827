"""Tidy tables of a run or a truth: people, people_summary, groups, members, events and counts, and their files.

A tidy table has one observation a row. The names of its columns end with their unit: `x_m`, `speed_m_s`, `t_s`; what is
in the image is in px. Unknown values are empty cells. Groups and members are those that the run or truth states in each
frame; nothing is derived anew, so the tables agree with it.

All tables are written as CSV or Parquet; the people also as texts of positions on the ground in m. TrajNet++: a JSON
object a line, for each person a scene that spans the frames of the person, then a track for each person and frame.
PedPy and JuPedSim: lines `id frame x y`, apart by tabs, below comments with the frame rate and the names of columns.

Counts are of lines that people cross, and of zones in which they are, per minute. A place is a polygon of K corners in
the plane of the positions: of two corners, a line; of more, a zone, whose edges do not cross. Who goes from one side of
a line to the other between two sightings has crossed it, however long the gap. Left and right are those of somebody who
stands at the first corner and looks at the second one. Who walks up and down on a line is counted each time; the
difference of both directions holds all the same.
"""

from __future__ import annotations

import json
import math
import re
import warnings
from collections.abc import Iterable, Iterator, Mapping
from collections.abc import Sequence as Series
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from scenarios.errors import reject
from scenarios.limits import COORDINATE
from sim.arrays import joined, no_ids
from sim.geometry.polygons import cross
from sim.store.atomic import write_file
from sim.store.numeric_text import number_or_nan
from sim.store.own_files import refuse_foreign_file
from sim.store.tables import parquet_bytes
from sim.truth.velocities import differentiate
from sim.types import Array, Bools, GroupEvent, Groups, Ints, Tracks, Truth

if TYPE_CHECKING:
    import pyarrow

Form = Literal["csv", "parquet", "trajnet", "pedpy"]
# name and beginning of the texts of people; of nobody, one is empty
TEXTS = {
    "trajnet": ("people.ndjson", rb'\{"scene": \{"id": 0, "p": \d+, "s": \d+, "e": \d+, "fps": [0-9.e+-]+\}\}\n|\Z'),
    "pedpy": ("people.txt", rb"# framerate: \S+\n# id\tframe\tx/m\ty/m\n"),
}
MINUTE = 60.0  # s
LINE = 2  # corners of a line
THIN = 1e-6  # m or px: shorter lines have no length, and thinner zones no area
Places = Mapping[str, Array]  # by name the corners (K, 2), m or px
NOWHERE: Places = {}
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
        kinds = dict.fromkeys(self.columns) | lists | {"kind": pa.string()}
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
        counts: One row per minute.
    """

    people: TidyTable
    people_summary: TidyTable
    groups: TidyTable
    members: TidyTable
    events: TidyTable
    counts: TidyTable


@dataclass(frozen=True, eq=False)
class _Rows:
    """What a run and a truth have in common: R rows of people, G rows of groups in frames, events."""

    fps: float
    listed: Ints  # frames that were observed; frames between them break no interval
    unit: str  # of positions: "m" or "px"
    # people, (R,) or (R, D), sorted by (frame, id); vel is nan, group -1 where unknown
    frame: Ints
    id: Ints
    group: Ints
    pos: Array
    vel: Array
    heading: Array | None  # (R,) rad, None: the direction of vel
    box: Array | None  # (R, 4) px
    score: Array | None
    more: Mapping[str, Array | Ints]  # visibility, truncation and subgroup (R,), by name, those that are known
    groups: Series[Groups] | None  # of each listed frame; None: not labelled
    events: Series[GroupEvent]
    places: Places

    def seconds(self, frame: Any) -> Any:
        return (frame - 1) / self.fps


def run_tables(tracks: Series[Tracks], fps: float, places: Places = NOWHERE) -> TidyTables:
    """Returns the tidy tables of a run. tracks: one Tracks per frame. For tracks of groups the people tables are empty.

    places: lines and zones by name; `counts` gets columns for each.
    """
    from sim.store.track_files import flatten

    rows = flatten(list(tracks))
    people = slice(0, 0) if rows.unit == "group" else slice(None)
    known = any(t.groups is not None for t in tracks)
    return _tables(
        _Rows(
            fps, np.array([t.index for t in tracks], np.int64), "px" if rows.plane == "image" else "m",
            rows.frame[people], rows.id[people], rows.group[people], rows.pos[people], rows.vel[people], None,
            None if rows.boxless.all() else rows.box[people], rows.score[people], {},
            [t.groups or Groups.none() for t in tracks] if known else None, [e for t in tracks for e in t.events],
            places,
        )
    )  # fmt: skip


def truth_tables(truth: Truth, places: Places = NOWHERE) -> TidyTables:
    """Returns the tidy tables of a truth, in m if it has positions on the ground, else of the boxes' centres in px.

    places: lines and zones by name; `counts` gets columns for each.
    """
    pos, vel, unit = truth.pos, truth.vel, "m"
    if pos is None:
        assert truth.box is not None
        pos, unit = truth.box[:, :2] + truth.box[:, 2:] / 2, "px"
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
            truth.fps, listed, unit, truth.frame, truth.id, truth.group, pos, vel, truth.heading, truth.box, None,
            {name: values for name, values in more.items() if values is not None}, groups, truth.events or (), places,
        )
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
    found = {folder / f"{f.name}.{form}": getattr(tables, f.name).to_arrow() for f in fields(tables)}
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


def _tables(rows: _Rows) -> TidyTables:
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
    return TidyTables(
        TidyTable(people), TidyTable(_summary(rows, speed, members)), TidyTable(_groups(rows, number, group, size)),
        TidyTable(_intervals(rows, *members)), TidyTable(_events(rows)), TidyTable(_counts(rows, number, group)),
    )  # fmt: skip


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


def _counts(rows: _Rows, number: Ints, group: Ints) -> dict[str, Any]:
    """Returns how many people, groups and events are in each minute; means are over the frames that were observed."""
    # People may be labelled in frames whose groups are not.
    observed = np.union1d(rows.listed, rows.frame)
    end = float(rows.seconds(observed[-1] + 1)) if len(observed) else 0.0
    minutes = np.arange(math.ceil(end / MINUTE - 1e-9))

    def minute(frame: Ints) -> Ints:
        return np.asarray(rows.seconds(frame) / MINUTE + 1e-9).astype(np.int64)

    def distinct(frame: Ints, id: Ints) -> Ints:
        pairs = np.unique(np.stack([minute(frame), id], axis=1), axis=0)
        return _per(pairs[:, 0], minutes)

    def mean(frame: Ints, frames: Ints) -> Array:
        return np.asarray(_per(minute(frame), minutes) / np.maximum(_per(minute(frames), minutes), 1))

    def arrivals(frame: Ints, id: Ints) -> Ints:
        order = np.lexsort((frame, id))
        return _per(minute(frame[order][np.unique(id[order], return_index=True)[1]]), minutes)

    columns = {
        "minute": minutes, "t_start_s": minutes * MINUTE, "t_end_s": np.minimum((minutes + 1) * MINUTE, end),
        "people": distinct(rows.frame, rows.id), "people_new": arrivals(rows.frame, rows.id),
        "people_mean": mean(rows.frame, observed),
    }  # fmt: skip
    if rows.groups is not None:
        columns["groups"] = distinct(number, group)
        columns["groups_mean"] = mean(number, rows.listed)
    starts = np.array([e.start for e in rows.events], np.int64)
    columns["events"] = _per(minute(starts), minutes)
    known = rows.pos[np.isfinite(rows.pos).all(axis=1), :2]
    for name, corners in rows.places.items():
        ends = known.min(axis=0, initial=np.inf), known.max(axis=0, initial=-np.inf)
        if len(known) and ((corners.max(axis=0) < ends[0]) | (corners.min(axis=0) > ends[1])).any():
            area = " and ".join(f"{k} from {low:.4g} to {high:.4g}" for k, low, high in zip("xy", *ends, strict=True))
            warnings.warn(f"{name} lies outside all positions, which have {area} {rows.unit}", stacklevel=2)
        if len(corners) == LINE:
            left, right = crossings(rows.frame, rows.id, rows.pos, corners, downwards=rows.unit == "px")
            columns[f"{name}_to_left"] = _per(minute(left), minutes)
            columns[f"{name}_to_right"] = _per(minute(right), minutes)
        else:
            there = inside(rows.pos, corners)
            columns[f"{name}_people"] = distinct(rows.frame[there], rows.id[there])
            columns[f"{name}_people_mean"] = mean(rows.frame[there], observed)
    return columns


def _per(minute: Ints, minutes: Ints) -> Ints:
    return np.bincount(minute, minlength=len(minutes))[: len(minutes)]


def parse_places(lines: Iterable[str], zones: Iterable[str]) -> Places:
    """Returns the corners (K, 2) of each place, by name.

    lines: texts of two corners, such as "door=2,5,4,5". zones: texts of three or more corners, such as
    "hall=0,0,9,0,9,6". Raises InputError if a text has another form, a name is repeated, a line has no length, or a
    zone has no area or edges that cross.
    """
    found: dict[str, Array] = {}
    forms = {"--line": "NAME=x1,y1,x2,y2", "--zone": "NAME=x1,y1,x2,y2,x3,y3,…"}
    for option, text in [*(("--line", text) for text in lines), *(("--zone", text) for text in zones)]:
        name, _, cells = text.partition("=")
        values = list(map(number_or_nan, cells.split(",")))
        count = len(values) == 4 if option == "--line" else len(values) >= 6 and len(values) % 2 == 0
        form = f"{forms[option]}, each name once, of letters, digits and _"
        remedy = "write --line door=2,5,4,5 or --zone hall=0,0,9,0,9,6; in px for tracks in the image"
        right = name.isidentifier() and name not in found and count and np.max(np.abs(values)) <= COORDINATE
        reject(not right, "", repr(text), form, remedy, option)
        found[name] = np.reshape(values, (-1, 2))
        fault, expected = _fault(found[name]), "two ends apart" if option == "--line" else "corners in order round it"
        reject(fault, "", f"{text!r}, {fault}", expected, remedy, option)
    return found


def _fault(corners: Array) -> str:
    """Returns why corners (K, 2) are no line or zone, "" if they are one."""
    size = float(np.ptp(corners, axis=0).max())
    if len(corners) == LINE:
        return "" if size > THIN else "of length 0"
    a, b = corners, np.roll(corners, -1, axis=0)
    sides = [cross(b - a, point - a) for point in corners]  # of corner j from edge i: above 0 if it lies to the left
    left = np.array(sides).T
    apart = left * np.roll(left, -1, axis=1) < 0  # edge i has the ends of edge j on its two sides
    if (apart & apart.T).any():
        return "whose edges cross"
    return "" if abs(cross(a, b).sum()) > 2 * THIN * size else "of area 0"


def crossings(frame: Ints, id: Ints, pos: Array, line: Array, downwards: bool) -> tuple[Ints, Ints]:
    """Returns the frames of crossings to the left side of a line, and of crossings to the right side.

    Each crossing gives the first frame on the other side. frame, id (N,), pos (N, 2): people, in any order. line
    (2, 2): its two ends, beyond which nobody crosses it; left and right are those of somebody who looks from the first
    to the second. downwards: True if y points down, as in the image.
    """
    order = np.lexsort((frame, id))
    frame, pos = frame[order], pos[order, :2]
    same = np.diff(id[order]) == 0
    a, b, when = pos[:-1][same], pos[1:][same], frame[1:][same]
    along, step = line[1] - line[0], b - a
    before, after = cross(along, a - line[0]) > 0, cross(along, b - line[0]) > 0
    # The ends of the line are on different sides of the step, too.
    hits = (before != after) & ((cross(step, line[0] - a) > 0) != (cross(step, line[1] - a) > 0))
    left = after != downwards
    return when[hits & left], when[hits & ~left]


def inside(pos: Array, zone: Array) -> Bools:
    """Returns flags (N,): True for points pos (N, 2) inside the polygon `zone` (K, 2): a ray to the right from there
    crosses an odd number of its edges."""
    start, end, point = zone, np.roll(zone, -1, axis=0), pos[:, None, :2]
    passed = (start[:, 1] > point[..., 1]) != (end[:, 1] > point[..., 1])
    to_the_right = (cross(end - start, point - start) > 0) == (end[:, 1] > start[:, 1])
    return np.asarray((passed & to_the_right).sum(axis=1) % 2 == 1)
