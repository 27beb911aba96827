"""The groups of each frame as files, and back.

groups.parquet holds the exact values. groups.csv holds text for other programs, with each group's hull as a WKT text
"POLYGON ((x y, …))".
"""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence as Series
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenarios.errors import InputError
from scenarios.limits import COORDINATE, FRAMES
from sim.io.files.numeric_text import read_text, whole_number
from sim.io.files.tables import Column, StoredTable, table_bytes
from sim.types import Array, Groups, Ints

CSV_COLUMNS = ("frame", "group", "members", "x", "y", "hull", "size")
EXTENT = ("extent_xx", "extent_xy", "extent_yx", "extent_yy")
AXES = ("x", "y", "z")
_Row = tuple[int, Ints, Array, float, Array]  # group's id, members, x and y, size, hull


def groups_bytes(frames: Series[Groups | None], first: int, unit: str) -> bytes:
    """Return groups.parquet as bytes, for the groups of consecutive frames, the first of which has index `first`.

    unit: "m" or "px", that of positions and hulls. An item of `frames` may be None (groups unknown), which is stored
    apart from a frame without groups. One row per frame and group; columns: frame, group (id), members (person ids), x,
    y, (z), vx, vy, (vz), extent_xx, extent_xy, extent_yx, extent_yy (covariance of the members' positions), size
    (people), hull (x1, y1, x2, …). Frames whose groups have no lists of members are noted as such; missing hulls are
    stored as hulls without vertices. Positions of all frames have equally many columns, else ValueError.
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
        *(Column(a, pos[:, k], unit) for k, a in enumerate(axes)),
        *(Column(f"v{a}", vel[:, k], f"{unit}/s") for k, a in enumerate(axes)),
        *(Column(name, extent[:, k], f"{unit}^2") for k, name in enumerate(EXTENT)),
        Column("size", np.concatenate([np.zeros(0), *(g.size for g in known)]), "people"),
        Column("hull", _lists([g.hull for g in known], ids, np.zeros(0)), f"{unit}: x1, y1, x2, …"),
    ]
    missing = [first + k for k, g in enumerate(frames) if g is None]
    memberless = [first + k for k, g in enumerate(frames) if g is not None and len(g.members) < len(g.id)]
    facts = {"first": first, "frames": len(frames), "missing": missing, "memberless": memberless}
    return table_bytes(columns, facts)


def _lists(rows: list[tuple[Any, ...]], ids: list[Ints], empty: NDArray[Any]) -> list[NDArray[Any]]:
    """Return one flat array per group, over all frames.

    rows: of each frame the lists of its groups (members or hulls), or () if that frame has none. ids: of each frame its
    group ids. empty: the array, of the wanted number type, for a group of a frame without lists.
    """
    every = [item for row, id in zip(rows, ids, strict=True) for item in (row or (empty,) * len(id))]
    return [np.asarray(item, empty.dtype).ravel() for item in every]


def _stack(parts: list[Array], width: int) -> Array:
    return np.concatenate([np.zeros((0, width)), *parts])


def read_groups(table: StoredTable) -> list[Groups | None]:
    """Return the groups of each frame of a groups.parquet that was read as a table, in the order of frames.

    An item is None for a frame whose groups are unknown, and Groups without rows for a frame without groups. Members
    are () in a frame that was stored without them, hulls have no vertices. The first item is the first frame stored,
    which need not be 1. Raises InputError if a column or a value of the metadata is missing or wrong, a row is outside
    these frames, rows are not sorted by frame, or a hull has half a vertex.
    """
    first, count = table.count("first", FRAMES), table.count("frames", FRAMES)
    missing, memberless = table.frames("missing"), table.frames("memberless")
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
        who = () if first + k in memberless else tuple(members[r])
        some = Groups(id[r], who, pos[r], vel[r], extent[r], size[r], tuple(hulls[r]))
        found.append(None if first + k in missing else some)
    return found


def wkt(hull: Array, digits: int) -> str:
    """Return a hull, vertices (V, 2) x, y, as text "POLYGON ((x y, …))" with the first vertex repeated at the end.

    digits: decimals of each number. A hull without vertices is "POLYGON EMPTY".
    """
    points = [f"{x:.{digits}f} {y:.{digits}f}" for x, y in hull]
    return f"POLYGON (({', '.join([*points, points[0]])}))" if points else "POLYGON EMPTY"


def parse_wkt(text: str) -> Array:
    """Return the vertices (V, 2) x, y of a WKT POLYGON of one ring; a last vertex equal to the first is left out.

    "POLYGON EMPTY" gives shape (0, 2). Raises ValueError for other texts and for coordinates that are not finite.
    """
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
    """Return groups.csv as bytes, for consecutive frames, the first of which has index `first`.

    ground: groups of each frame in the plane of their tracks or truth, None if unknown. image: groups of each frame in
    px, as long as `ground` if both are given; None if unknown. Columns: frame, group (id), members (ids separated by
    blanks), x, y, hull (WKT, 3 decimals), size, and, if `image` is given, hull_px (WKT, 2 decimals) of the group with
    the same id, empty without one. Where the ground groups of a frame are unknown, its rows are the image's groups, and
    x, y and hull are empty. Unknown numbers (nan) are empty, too. Without both, or without groups, there is the header
    alone.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*CSV_COLUMNS, *(["hull_px"] if image is not None else [])])
    for k in range(len(ground if ground is not None else image or ())):
        here = None if ground is None else ground[k]
        px = None if image is None else image[k]
        pictured = {} if px is None else {int(g): wkt(h, 2) for g, h in zip(px.id, px.hull, strict=False)}
        for row in _csv_rows(here if here is not None else Groups.none() if px is None else _placeless(px)):
            writer.writerow([first + k, *row, *([pictured.get(row[0], "")] if image is not None else [])])
    return text.getvalue().encode()


def _placeless(groups: Groups) -> Groups:
    return groups.replace(pos=np.full_like(groups.pos, np.nan), hull=())


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
    """Read a groups.csv, ours or another program's, as the Groups of each frame from 1 to `length`.

    The columns frame, group, members (ids separated by blanks), x, y and hull (WKT) must exist; size may be missing,
    and further columns are ignored. Empty x, y and size become nan, an empty hull has no vertices. Velocities are 0,
    extents nan. Groups are sorted by id; members of each are sorted, each once. A frame without lines has Groups
    without rows. Whether members exist is not checked.

    Raises InputError if the file is unreadable, and, with the line, if a column is missing, a cell is invalid, a frame
    is outside 1 to `length`, an id or size is negative, a coordinate is beyond 1e6, or a group stands twice in a frame.
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
    """Return (frame, its group) of one row; raise InputError, with the line, if a cell is wrong."""
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
    n = len(rows)
    return Groups(
        np.array(id, np.int64),
        members,
        np.array(pos),
        np.zeros((n, 2)),
        np.full((n, 2, 2), np.nan),
        np.array(size),
        hull,
    )


def _bad(path: Path, line: int, got: str, expected: str) -> InputError:
    return InputError(file=path, place=f"line {line}", got=got, expected=expected, remedy="correct the line")
