"""Groups and events of a truth or a run, to bytes and back: tables and CSV of groups, small files of events.

events.json: group events. near.csv: hard negatives, that is pairs of people who satisfy the merge rule but are
strangers; frames from 1. script.json: the orders of the scenario's script.
groups.parquet holds the exact values of groups, groups.csv text for other programs, with each group's hull as a WKT
text "POLYGON ((x y, …))".
"""

from __future__ import annotations

import csv
import io
import re
import warnings
from collections.abc import Iterable
from collections.abc import Sequence as Series
from itertools import zip_longest
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, Field, model_validator

from scenarios.errors import counted, reject
from scenarios.limits import COORDINATE, FRAMES, INTEGER
from scenarios.reading import is_present
from sim.arrays import joined, no_ids
from sim.store import tables
from sim.store.numeric_text import is_number_text, read_number, read_rows, read_text, whole_or_number
from sim.store.tables import AXES, EXTENT, Count, FrameNumber, Id, Number, Pair, StoredTable, along, validated
from sim.stuck import Immobile, NeverArrives
from sim.types import EVENT_KINDS, Array, GroupEvent, Groups, Ints, Near, Order

NEAR_COLUMNS = "start,end,a,b"
NEVER_ARRIVES, IMMOBILE = "gt/never_arrives.json", "gt/immobile.json"
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


def read_events(path: Path) -> list[tuple[GroupEvent, int | None]]:
    """Returns the events of an events.json as pairs: the event, and the frame whose tracks reported it or None."""
    found = tables.read_values(path, "correct the event", events=list[_Event]).events
    places = [(tables.none_to_nan(e.pos[0]), tables.none_to_nan(e.pos[1])) for e in found]
    fields = [e.model_dump(exclude={"frame", "pos"}) for e in found]
    return [(GroupEvent(**f, pos=pos), e.frame) for f, pos, e in zip(fields, places, found, strict=True)]


def read_near(path: Path) -> Near:
    """Returns the hard negatives in a near.csv; raises InputError for a wrong line."""
    text = read_rows(path)
    header = "".join(text.text[:1])
    _require(header == NEAR_COLUMNS, path, 1, repr(header), NEAR_COLUMNS)
    rows = text.numbers((4,), first=1, layout=NEAR_COLUMNS)
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


def read_script(path: Path) -> tuple[Order, ...]:
    """Returns the orders in a script.json; () if it has no list of orders."""
    found = tables.read_values(path, "restore it", orders=(tuple[_Order, ...], ()))
    return tuple(Order(**order.model_dump()) for order in found.orders)


def read_never_arrives(folder: Path) -> tuple[NeverArrives, ...]:
    """Returns the groups of a sequence folder that do not reach their goal; () if it has no such file."""
    path = folder / NEVER_ARRIVES
    kind = tuple[NeverArrives, ...]
    return tables.read_values(path, "restore it", groups=kind).groups if is_present(path) else ()


def read_immobile(folder: Path) -> tuple[Immobile, ...]:
    """Returns the people of a sequence folder who stood still on the way; () if it has no such file."""
    path = folder / IMMOBILE
    return tables.read_values(path, "restore it", people=tuple[Immobile, ...]).people if is_present(path) else ()


def stands_in(folder: Path) -> dict[str, list[str]]:
    """Returns sentences on the groups of a sequence folder that never arrive, and on its people who stood still."""
    found: dict[str, tuple[NeverArrives | Immobile, ...]]
    found = {"group": read_never_arrives(folder), "person": read_immobile(folder)}
    return {what: [one.words for one in some] for what, some in found.items() if some}


def warn_of(what: str, stands: Iterable[tuple[str, dict[str, list[str]]]]) -> None:
    """Warns once of all of one kind, "group" or "person", in sequences. stands: name and `stands_in` of each."""
    found = [(name, words) for name, some in stands for words in some.get(what, ())]
    if found:
        (name, first), sequences = found[0], len({name for name, _ in found})
        many = counted(len(found), what, "people" if what == "person" else "groups")
        more = f"; {many} in {counted(sequences, 'sequence')}" if len(found) > 1 else ""
        warnings.warn(f"{name}: {first}{more}", stacklevel=3)


CSV_COLUMNS = ("frame", "group", "members", "x", "y", "hull", "size")


def groups_bytes(frames: Series[Groups | None], first: int, unit: str) -> bytes:
    """Returns the content of groups.parquet, a row per frame and group, for consecutive frames from `first` on.

    unit: "m" or "px". The file distinguishes three kinds of frames: groups unknown (None), no groups, and groups whose
    members are unknown.
    """
    import pyarrow as pa

    known = [g for g in frames if g is not None]
    some = [g for g in known if len(g.id)] or known[:1]  # frames without groups may not know the plane
    axes = AXES[: some[0].pos.shape[1]] if some else AXES[:2]
    counts = [0 if g is None else len(g.id) for g in frames]
    ids = [g.id for g in known]
    members = _lists([g.members for g in known], ids, no_ids())
    columns: tables.Columns = {
        "frame": np.repeat(np.arange(first, first + len(frames), dtype=np.int64), counts),
        "group": joined(ids, kind=np.int64), "members": pa.array(members, pa.list_(pa.int64())),
        axes: joined((g.pos for g in some), len(axes)), along(axes): joined((g.vel for g in some), len(axes)),
        EXTENT: joined((g.extent.reshape(-1, 4) for g in known), 4), "size": joined(g.size for g in known),
        "hull": pa.array(_lists([g.hull for g in known], ids, np.zeros(0)), pa.list_(pa.float64())),
    }  # fmt: skip
    missing = [first + k for k, g in enumerate(frames) if g is None]
    memberless = [first + k for k, g in enumerate(frames) if g is not None and len(g.members) < len(g.id)]
    facts = {"first": first, "frames": len(frames), "missing": missing, "memberless": memberless}
    return tables.table_bytes(columns, facts, tables.units_of(unit))


def _lists(rows: list[tuple[Any, ...]], ids: list[Ints], empty: NDArray[Any]) -> list[NDArray[Any]]:
    every = [item for row, id in zip(rows, ids, strict=True) for item in (row or (empty,) * len(id))]
    return [np.asarray(item, empty.dtype).ravel() for item in every]


def read_groups(table: StoredTable) -> list[Groups | None]:
    """Returns the Groups of each frame stored in a groups.parquet; None for a frame whose groups are unknown."""
    facts = table.facts_as(first=Count, frames=Count, missing=set[int], memberless=set[int])
    first, count = facts.first, facts.frames
    axes = AXES if "z" in table.columns else AXES[:2]
    id, size = table.ints("group"), table.floats("size")
    pos, vel = table.floats(*axes), table.floats(*along(axes))
    extent = table.floats(*EXTENT).reshape(-1, 2, 2)
    members, flat = table.lists("members", np.int64), table.lists("hull", np.float64)
    table.reject(any(len(h) % 2 for h in flat), "hull", "half a vertex", "x and y of each vertex")
    hulls = [h.reshape(-1, 2) for h in flat]
    none = Groups(id[:0], (), pos[:0], vel[:0], extent[:0], size[:0], ())  # of most frames of some long recordings
    found: list[Groups | None] = []
    for k, r in enumerate(table.cuts(first, count), first):
        who = () if k in facts.memberless else tuple(members[r])
        some = Groups(id[r], who, pos[r], vel[r], extent[r], size[r], tuple(hulls[r])) if len(id[r]) else none
        found.append(None if k in facts.missing else some)
    return found


def wkt(hull: Array, digits: int) -> str:
    """Returns a hull (V, 2) as "POLYGON ((x y, …))" with this many decimals, the first vertex repeated at the end."""
    points = [f"{x:.{digits}f} {y:.{digits}f}" for x, y in hull]
    return f"POLYGON (({', '.join([*points, points[0]])}))" if points else "POLYGON EMPTY"


def parse_wkt(text: str) -> list[list[float]]:
    """Returns the vertices [x, y] of a WKT POLYGON of one ring, [] if it is EMPTY; ValueError for other texts."""
    body = re.fullmatch(r"\s*POLYGON\s*(?:EMPTY|\(\s*\(([^()]*)\)\s*\))\s*", text)
    points = [point.split() for point in (body[1] or "").split(",") if point.strip()] if body else [[]]
    if not all(len(xy) == 2 and all(map(is_number_text, xy)) for xy in points):
        raise ValueError("POLYGON ((x y, …)), pairs of numbers")
    ring = [[read_number(v) for v in xy] for xy in points]
    return ring[:-1] if len(ring) > 1 and ring[0] == ring[-1] else ring


def groups_csv(ground: Series[Groups | None] | None, image: Series[Groups | None] | None, first: int = 1) -> bytes:
    """Returns groups.csv for consecutive frames from `first` on; nan and unknown values are empty.

    ground: groups of each frame, with positions and hulls. image: the same groups in px, which give the column hull_px;
    None: no such column. For a frame whose ground groups are None, the groups of image are listed, without position.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*CSV_COLUMNS, *(["hull_px"] if image is not None else [])])
    for frame, (here, px) in enumerate(zip_longest(ground or (), image or ()), first):
        pictured = {} if px is None else {g: wkt(h, 2) for g, h in zip(px.id.tolist(), px.hull, strict=False)}
        if here is None:
            here = Groups.none() if px is None else px.replace(pos=np.full_like(px.pos, np.nan), hull=())
        for k, id in enumerate(here.id.tolist()):
            members = " ".join(map(str, here.members[k])) if len(here.members) else ""
            hull = wkt(here.hull[k], 3) if len(here.hull) else ""
            x, y, size = (_cell(v) for v in (here.pos[k, 0], here.pos[k, 1], here.size[k]))
            more = [pictured.get(id, "")] if image is not None else []
            writer.writerow([frame, id, members, x, y, hull, size, *more])
    return text.getvalue().encode()


def _cell(value: float) -> str:
    return "" if value != value else f"{value:.3f}".rstrip("0").rstrip(".")


def _value(text: str) -> int | float | str | None:
    value = whole_or_number(text)
    return None if value in ("", "nan") or value != value else value


def _ids(text: str | None) -> list[Any]:
    return [whole_or_number(word) for word in (text or "").split()]


class _GroupRow(BaseModel):
    """A row of groups.csv."""

    frame: Annotated[FrameNumber, BeforeValidator(_value)]
    group: Annotated[Id, BeforeValidator(_value)]
    members: Annotated[list[Id], BeforeValidator(_ids)]
    x: Annotated[Number | None, BeforeValidator(_value)] = None
    y: Annotated[Number | None, BeforeValidator(_value)] = None
    hull: Annotated[tuple[Pair, ...], BeforeValidator(lambda text: parse_wkt(text) if text else ())] = ()
    size: Annotated[Annotated[Number, Field(ge=0)] | None, BeforeValidator(_value)] = None


def read_groups_csv(path: Path, length: int) -> list[Groups]:
    """Reads a groups.csv, ours or another program's, as the Groups of each frame from 1 to `length`.

    The file has no velocities and extents: they are 0 and nan. Groups and members are sorted by id.
    """
    reader = csv.DictReader(io.StringIO(read_text(path)))
    frames: dict[int, dict[int, _GroupRow]] = {k: {} for k in range(1, length + 1)}
    try:
        wanted = [c for c in CSV_COLUMNS[:6] if c not in (reader.fieldnames or [])]
        _require(not wanted, path, 1, f"no column {', '.join(wanted)}", ",".join(CSV_COLUMNS))
        for cells in reader:
            given = {name: cell for name, cell in cells.items() if name and cell is not None}
            row = validated(path, given, _GroupRow, "correct the line", f"line {reader.line_num}")
            got, expected = f"group {row.group} in frame {row.frame}", f"frames to {length}, each group once in one"
            once = row.frame <= length and row.group not in frames[row.frame]
            _require(once, path, reader.line_num, got, expected)
            frames[row.frame][row.group] = row
    except csv.Error as error:
        _require(False, path, reader.line_num, str(error), "cells of text")
    nobody = Groups.none()
    return [_from_rows([rows[id] for id in sorted(rows)]) if rows else nobody for rows in frames.values()]


def _from_rows(rows: list[_GroupRow]) -> Groups:
    still, unknown = np.zeros((len(rows), 2)), np.full((len(rows), 2, 2), np.nan)
    return Groups(
        np.array([row.group for row in rows], np.int64),
        tuple(np.unique(np.array(row.members, np.int64)) for row in rows),
        np.array([(row.x, row.y) for row in rows], np.float64), still, unknown,
        np.array([row.size for row in rows], np.float64),
        tuple(np.array(row.hull, np.float64).reshape(-1, 2) for row in rows),
    )  # fmt: skip


def _require(right: bool, path: Path, line: int, got: str, expected: str) -> None:
    reject(not right, path, got, expected, "correct the line", f"line {line}")
