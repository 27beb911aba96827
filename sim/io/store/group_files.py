"""Groups and events of a truth or a run, to bytes and back: tables and CSV of groups, small files of events.

events.json: group events. near.csv: hard negatives, that is pairs of people who satisfy the merge rule but are
strangers; frames from 1. script.json: the orders of the scenario's script.
groups.parquet holds the exact values of groups, groups.csv text for other programs, with each group's hull as a WKT
text "POLYGON ((x y, …))".
"""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence as Series
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field, model_validator

from scenarios.errors import InputError
from scenarios.limits import COORDINATE, FRAMES, INTEGER
from sim.io.files import tables
from sim.io.files.numeric_text import read_numbers, read_text, whole_number
from sim.io.files.tables import Column, Count, FrameNumber, Id, Number, StoredTable, columns_of, none_to_nan, validated
from sim.types import EVENT_KINDS, Array, GroupEvent, Groups, Ints, Near, Order

NEAR_COLUMNS = "start,end,a,b"
GroupId = Annotated[int, Field(strict=True, ge=-1, le=INTEGER)]


class _Event(BaseModel):
    kind: Literal[EVENT_KINDS]  # type: ignore[valid-type]
    start: FrameNumber
    end: FrameNumber
    emitted: FrameNumber | None
    before: tuple[GroupId, ...]
    after: tuple[GroupId, ...]
    members: tuple[Id, ...]
    pos: tuple[Number | None, Number | None]
    frame: FrameNumber | None = None

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.start > self.end:
            raise ValueError("start not after end")
        return self


class _Events(BaseModel):
    events: list[_Event]


def read_events(path: Path) -> list[tuple[GroupEvent, int | None]]:
    """Reads an events.json as pairs (event, frame whose tracks reported it, None if not stored)."""
    found = validated(path, tables.read_document(path), _Events, "correct the event").events
    places = [(none_to_nan(e.pos[0]), none_to_nan(e.pos[1])) for e in found]
    fields = [e.model_dump(exclude={"frame", "pos"}) for e in found]
    return [(GroupEvent(**f, pos=pos), e.frame) for f, pos, e in zip(fields, places, found, strict=True)]


def read_near(path: Path) -> Near:
    """Reads a near.csv."""
    header = read_text(path).partition("\n")[0]
    if header != NEAR_COLUMNS:
        raise InputError(
            file=path, place="line 1", got=repr(header), expected=NEAR_COLUMNS, remedy="restore the header"
        )
    rows = read_numbers(path, (4, 4), header=True, layout=NEAR_COLUMNS)
    start, end, a, b = (rows.integers(k, name) for k, name in enumerate(NEAR_COLUMNS.split(",")))
    wrong = (start < 1) | (end < start) | (end > FRAMES) | (np.minimum(a, b) < 0)
    expected = f"frames from 1 to {FRAMES}, start not after end, and two ids from 0 on"
    rows.reject(wrong, expected, "restore it", "restore them")
    return Near(start, end, a, b)


class _Order(BaseModel):
    id: str
    kind: str
    fired: FrameNumber | None
    before: tuple[tuple[Id, ...], ...]
    after: tuple[tuple[Id, ...], ...]
    time: Annotated[float, Field(strict=True, ge=0, le=COORDINATE)] | None = None
    event: Id | None = None


class _Orders(BaseModel):
    orders: tuple[_Order, ...] = ()


def read_script(path: Path) -> tuple[Order, ...]:
    """Reads the orders of a script.json; a missing list gives none."""
    found = validated(path, tables.read_document(path), _Orders, "restore it").orders
    return tuple(Order(**order.model_dump()) for order in found)


CSV_COLUMNS = ("frame", "group", "members", "x", "y", "hull", "size")
EXTENT = ("extent_xx", "extent_xy", "extent_yx", "extent_yy")
AXES = ("x", "y", "z")
_Row = tuple[int, Ints, Array, float, Array]  # group's id, members, x and y, size, hull


def groups_bytes(frames: Series[Groups | None], first: int, unit: str) -> bytes:
    """Returns groups.parquet, a row per frame and group, for consecutive frames from `first` on.

    unit: "m" or "px". None (groups unknown) is stored apart from a frame without groups, and so are frames whose groups
    have no members.
    """
    known = [g for g in frames if g is not None]
    axes = AXES[: known[0].pos.shape[1]] if known else AXES[:2]
    counts = [0 if g is None else len(g.id) for g in frames]
    ids = [g.id for g in known]
    pos, vel = _stack([g.pos for g in known], len(axes)), _stack([g.vel for g in known], len(axes))
    extent = _stack([g.extent.reshape(-1, 4) for g in known], 4)
    columns = [
        Column("frame", np.repeat(np.arange(first, first + len(frames), dtype=np.int64), counts)),
        Column("group", np.concatenate([np.zeros(0, np.int64), *ids])),
        Column("members", _lists([g.members for g in known], ids, np.zeros(0, np.int64)), "1", np.int64),
        *columns_of(axes, pos, unit), *columns_of([f"v{a}" for a in axes], vel, f"{unit}/s"),
        *columns_of(EXTENT, extent, f"{unit}^2"),
        Column("size", np.concatenate([np.zeros(0), *(g.size for g in known)]), "people"),
        Column("hull", _lists([g.hull for g in known], ids, np.zeros(0)), f"{unit}: x1, y1, x2, …"),
    ]  # fmt: skip
    missing = [first + k for k, g in enumerate(frames) if g is None]
    memberless = [first + k for k, g in enumerate(frames) if g is not None and len(g.members) < len(g.id)]
    facts = {"first": first, "frames": len(frames), "missing": missing, "memberless": memberless}
    return tables.table_bytes(columns, facts)


def _lists(rows: list[tuple[Any, ...]], ids: list[Ints], empty: NDArray[Any]) -> list[NDArray[Any]]:
    every = [item for row, id in zip(rows, ids, strict=True) for item in (row or (empty,) * len(id))]
    return [np.asarray(item, empty.dtype).ravel() for item in every]


def _stack(parts: list[Array], width: int) -> Array:
    return np.concatenate([np.zeros((0, width)), *parts])


class _GroupFacts(BaseModel):
    first: Count
    frames: Count
    missing: set[int]
    memberless: set[int]


def read_groups(table: StoredTable) -> list[Groups | None]:
    """Returns the groups of each frame stored in a groups.parquet; None where they are unknown."""
    facts = table.facts_as(_GroupFacts)
    first, count = facts.first, facts.frames
    axes = AXES if table.has("z") else AXES[:2]
    id, size = table.ints("group"), table.floats("size")
    pos, vel = table.floats(*axes), table.floats(*(f"v{a}" for a in axes))
    extent = table.floats(*EXTENT).reshape(-1, 2, 2)
    members, flat = table.lists("members", np.int64), table.lists("hull", np.float64)
    table.reject(any(len(h) % 2 for h in flat), "hull", "half a vertex", "x and y of each vertex")
    hulls, cuts = [h.reshape(-1, 2) for h in flat], table.cuts(first, count)
    found: list[Groups | None] = []
    for k in range(count):
        r = slice(int(cuts[k]), int(cuts[k + 1]))
        who = () if first + k in facts.memberless else tuple(members[r])
        some = Groups(id[r], who, pos[r], vel[r], extent[r], size[r], tuple(hulls[r]))
        found.append(None if first + k in facts.missing else some)
    return found


def wkt(hull: Array, digits: int) -> str:
    """Returns a hull (V, 2) as text "POLYGON ((x y, …))", the first vertex repeated at the end."""
    points = [f"{x:.{digits}f} {y:.{digits}f}" for x, y in hull]
    return f"POLYGON (({', '.join([*points, points[0]])}))" if points else "POLYGON EMPTY"


def parse_wkt(text: str) -> Array:
    """Returns the vertices (V, 2) of a WKT POLYGON of one ring; raises ValueError for other texts."""
    body = text.strip().removeprefix("POLYGON").strip()
    if body == "EMPTY":
        return np.zeros((0, 2))
    if not (text.strip().startswith("POLYGON") and body.startswith("((") and body.endswith("))")):
        raise ValueError("expected POLYGON ((…))")
    ring = np.array([[float(v) for v in point.split()] for point in body[2:-2].split(",")])
    if ring.ndim != 2 or ring.shape[1] != 2 or not np.isfinite(ring).all():
        raise ValueError("points are pairs of finite numbers")
    return ring[:-1] if len(ring) > 1 and np.array_equal(ring[0], ring[-1]) else ring


def groups_csv(ground: Series[Groups | None] | None, image: Series[Groups | None] | None, first: int = 1) -> bytes:
    """Returns groups.csv for consecutive frames from `first` on; nan and unknown values are empty.

    ground: groups of each frame in the plane of their tracks or truth. image: those in px, whose hull is hull_px; a
    frame whose ground groups are unknown lists the image's groups, without place.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*CSV_COLUMNS, *(["hull_px"] if image is not None else [])])
    for k in range(len(ground if ground is not None else image or ())):
        here = None if ground is None else ground[k]
        px = None if image is None else image[k]
        pictured = {} if px is None else {int(g): wkt(h, 2) for g, h in zip(px.id, px.hull, strict=False)}
        if here is None:
            here = Groups.none() if px is None else px.replace(pos=np.full_like(px.pos, np.nan), hull=())
        for row in _csv_rows(here):
            writer.writerow([first + k, *row, *([pictured.get(row[0], "")] if image is not None else [])])
    return text.getvalue().encode()


def _csv_rows(groups: Groups) -> list[tuple[int, str, str, str, str, str]]:
    rows = []
    for k, id in enumerate(groups.id):
        members = " ".join(map(str, groups.members[k])) if len(groups.members) else ""
        hull = wkt(groups.hull[k], 3) if len(groups.hull) else ""
        x, y, size = (_cell(v) for v in (groups.pos[k, 0], groups.pos[k, 1], groups.size[k]))
        rows.append((int(id), members, x, y, hull, size))
    return rows


def _cell(value: float) -> str:
    return "" if value != value else f"{value:.3f}".rstrip("0").rstrip(".")


def read_groups_csv(path: Path, length: int) -> list[Groups]:
    """Reads a groups.csv, ours or another program's, as the Groups of each frame from 1 to `length`.

    Velocities are 0, extents nan. Groups and members are sorted by id.
    """
    reader = csv.DictReader(io.StringIO(read_text(path)))
    frames: dict[int, list[_Row]] = {}
    try:
        wanted = [c for c in CSV_COLUMNS[:6] if c not in (reader.fieldnames or [])]
        if wanted:
            raise _bad(path, 1, f"no column {', '.join(wanted)}", ",".join(CSV_COLUMNS))
        for row in reader:
            frame, group = _row(path, reader.line_num, row, length)
            if any(group[0] == other[0] for other in frames.setdefault(frame, [])):
                got = f"group {group[0]} twice in frame {frame}"
                raise _bad(path, reader.line_num, got, "each group once in a frame")
            frames[frame].append(group)
    except csv.Error as error:
        raise _bad(path, reader.line_num, str(error), "cells of text") from None
    nobody = Groups.none()
    return [_from_rows(sorted(frames[k], key=lambda r: r[0])) if k in frames else nobody for k in range(1, length + 1)]


def _row(path: Path, line: int, row: dict[str, str], length: int) -> tuple[int, _Row]:
    try:
        frame, id = whole_number(row["frame"]), whole_number(row["group"])
        members = np.array(sorted({whole_number(m) for m in row["members"].split()}), np.int64)
        pos = np.array([float(row["x"] or "nan"), float(row["y"] or "nan")])
        size = float(row.get("size") or "nan")
        hull = parse_wkt(row["hull"]) if row["hull"] else np.zeros((0, 2))
    except (ValueError, TypeError, AttributeError) as error:
        raise _bad(path, line, str(error), "frame,group,members,x,y,hull (WKT)") from None
    if not 1 <= frame <= length or id < 0:
        raise _bad(path, line, f"frame {frame}, group {id}", f"frames from 1 to {length}, groups from 0")
    if members.min(initial=0) < 0 or size < 0 or (not np.isfinite(size) and row.get("size")):
        raise _bad(path, line, f"members {row['members']}, size {row.get('size')}", "ids from 0, and a size from 0")
    if max(abs(pos[~np.isnan(pos)]).max(initial=0), abs(hull).max(initial=0)) > COORDINATE:
        raise _bad(path, line, "a coordinate that is too large", f"coordinates within {COORDINATE:g}")
    return frame, (id, members, pos, size, hull)


def _from_rows(rows: list[_Row]) -> Groups:
    id, members, pos, size, hull = zip(*rows, strict=True)
    still, unknown = np.zeros((len(rows), 2)), np.full((len(rows), 2, 2), np.nan)
    return Groups(np.array(id, np.int64), members, np.array(pos), still, unknown, np.array(size), hull)


def _bad(path: Path, line: int, got: str, expected: str) -> InputError:
    return InputError(file=path, place=f"line {line}", got=got, expected=expected, remedy="correct the line")
