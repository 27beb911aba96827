"""The truth and the detections of a sequence as files, and back.

Parquet tables hold the exact values; MOTChallenge text (gt.txt, det.txt) holds them rounded, for other programs. gt.txt
is written only for a truth with boxes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError
from scenarios.reading import is_present
from sim.arrays import joined
from sim.scene.terrain import height_at
from sim.store import group_files, tables
from sim.store.seal import REDO
from sim.store.tables import AXES, BOX, PLANES, VISIBLE, Count, FrameNumber, Rate, Scale, StoredTable, along, read_table
from sim.types import Array, Bools, Detections, Groups, Ints, Order, Scene, Truth


def truth_files(truth: Truth) -> dict[str, bytes]:
    """Returns the files under gt/ of a truth, content by name; a file for which the truth has no values is left out."""
    files = {"gt/truth.parquet": _table(truth), "gt/script.json": tables.json_list("orders", map(_order, truth.orders))}
    if truth.box is not None:
        seen = has_box(truth.box)
        visibility = [f"1,1,{v:.3f}" for v in truth.visibility[seen].tolist()]
        files["gt/gt.txt"] = mot_text(truth.frame[seen], truth.id[seen], truth.box[seen], visibility)
    for name, groups, unit in (("groups", truth.groups, "m"), ("groups_px", truth.groups_px, "px")):
        if groups is not None:
            files[f"gt/{name}.parquet"] = group_files.groups_bytes(groups, 1, unit)
    if truth.groups is not None or truth.groups_px is not None:
        files["gt/groups.csv"] = group_files.groups_csv(truth.groups, truth.groups_px)
    if truth.events is not None:
        files["gt/events.json"] = tables.json_list("events", map(tables.plain, truth.events))
    if truth.near is not None:
        rows = zip(truth.near.start, truth.near.end, truth.near.a, truth.near.b, strict=True)
        lines = [group_files.NEAR_COLUMNS, *(",".join(map(str, row)) for row in rows)]
        files["gt/near.csv"] = "".join(f"{line}\n" for line in lines).encode()
    return files


def _table(truth: Truth) -> bytes:
    columns: tables.Columns = {
        "frame": truth.frame, "id": truth.id, "group": truth.group, "subgroup": truth.subgroup,
        ("x", "y"): truth.pos, ("vx", "vy"): truth.vel,
        BOX: truth.box, VISIBLE: truth.visible_box, "visibility": truth.visibility, "z": truth.z,
        "heading": truth.heading, "height": truth.height, "truncation": truth.truncation,
    }  # fmt: skip
    facts = {
        "name": truth.name, "fps": truth.fps, "length": truth.length, "px_per_m": tables.plain(truth.px_per_m),
        "labelled": None if truth.labelled is None else spans(truth.labelled),
    }  # fmt: skip
    return tables.table_bytes(columns, facts, tables.units_of("m"))


def _order(order: Order) -> dict[str, Any]:
    return {key: getattr(order, key) for key in ("id", "kind", "fired", "time", "before", "after", "event")}


def spans(flags: Bools) -> list[list[int]]:
    """Returns [first frame, last frame], from 1 and inclusive, of each run of True in flags (T,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [[int(a) + 1, int(b)] for a, b in edges.reshape(-1, 2)]


def _flags(table: StoredTable, spans: list[tuple[int, int]], length: int) -> Bools:
    flags = np.zeros(length, bool)
    for first, last in spans:
        table.reject(max(first, last) > length, "labelled", f"[{first}, {last}]", f"frames from 1 to {length}")
        flags[first - 1 : last] = True
    return flags


def has_box(box: Array) -> Bools:
    """Returns flags (R,): True for boxes (R, 4) that are finite and have width and height above 0."""
    return np.asarray(np.isfinite(box).all(axis=1) & (box[:, 2:] > 0).all(axis=1))


def mot_text(frame: Ints, id: Ints, box: Array, rest: Iterable[str]) -> bytes:
    """Returns a MOTChallenge text: of each row frame, id, box and the cells `rest`; an unknown box is -1,-1,-1,-1."""
    lines = []
    # rows of arrays: lists of all their numbers would need more memory than the text
    for f, i, row, boxed, end in zip(frame, id, box, has_box(box), rest, strict=True):
        left, top, width, height = row.tolist()
        corner = f"{left:.2f},{top:.2f},{max(width, 0.01):.2f},{max(height, 0.01):.2f}" if boxed else "-1,-1,-1,-1"
        lines.append(f"{f},{i},{corner},{end}\n")
    return "".join(lines).encode()


def score_and_place(score: Array, place: Array | None) -> Iterator[str]:
    """Yields the cells conf, x, y, z of R MOT lines. place (R, 3): positions in m, nan or None if unknown."""
    places = np.full((len(score), 3), np.nan) if place is None else place
    for s, xyz in zip(score, map(np.ndarray.tolist, places), strict=True):
        x, y, z = (f"{v:.3f}" for v in xyz) if all(map(math.isfinite, xyz)) else ("-1", "-1", "-1")
        yield f"{s:.4f},{x},{y},{z if z != '-1.000' else '-1.001'}"  # z = -1 would mean unknown


def read_truth(folder: Path) -> Truth:
    """Returns the truth in a sequence folder; fields that are not stored are None."""
    gt = folder / "gt"
    table = read_table(gt / "truth.parquet")
    labelled = list[tuple[FrameNumber, FrameNumber]] | None
    facts = table.facts_as(name=str, fps=Rate, length=Count, px_per_m=Scale | None, labelled=labelled)
    length = facts.length
    frame, id = table.ints("frame"), table.ints("id")
    table.cuts(1, length)
    twice = (np.diff(frame) == 0) & (np.diff(id) <= 0)
    place = f"row {int(np.argmax(twice)) + 1}" if len(twice) else ""
    table.reject(bool(twice.any()), place, "rows out of order, or twice", "rows sorted by (frame, id)")
    events = group_files.read_events(gt / "events.json") if is_present(gt / "events.json") else None
    return Truth(
        name=facts.name, fps=facts.fps, length=length, px_per_m=tables.none_to_nan(facts.px_per_m),
        frame=frame, id=id, group=table.ints("group"),
        subgroup=table.ints("subgroup") if "subgroup" in table.columns else None,
        pos=table.known("x", "y"), vel=table.known("vx", "vy"), box=table.known(*BOX),
        visible_box=table.known(*VISIBLE), visibility=table.floats("visibility"), z=table.known("z"),
        heading=table.known("heading"), height=table.known("height"), truncation=table.known("truncation"),
        groups=_groups(gt / "groups.parquet"), groups_px=_groups(gt / "groups_px.parquet"),
        labelled=None if facts.labelled is None else _flags(table, facts.labelled, length),
        events=None if events is None else tuple(e for e, _ in events),
        near=group_files.read_near(gt / "near.csv") if is_present(gt / "near.csv") else None,
        orders=group_files.read_script(gt / "script.json"),
    )  # fmt: skip


def _groups(path: Path) -> tuple[Groups, ...] | None:
    if not is_present(path):
        return None
    return tuple(g if g is not None else Groups.none() for g in group_files.read_groups(read_table(path)))


def detection_files(detections: list[Detections], fps: float, scene: Scene | None = None) -> dict[str, bytes]:
    """Returns det/det.parquet (exact) and det/det.txt (MOT text of 10 columns), content by name.

    detections: one Detections per frame, all of one plane, and all with or without boxes and velocities. scene: gives
    the z of ground points in det.txt; None: 0.
    """
    forms = {(d.plane, d.box is not None, d.vel is not None) for d in detections}
    assert len(forms) <= 1, f"detections of one sequence differ in kind: {sorted(forms)}"
    plane, boxed, moving = next(iter(forms), ("image", True, False))
    axes = AXES[: detections[0].pos.shape[1]] if detections else AXES[:2]
    pos = joined((d.pos for d in detections), len(axes))
    score = joined(scores_or_ones(d.score, len(d.pos)) for d in detections)
    frame = np.repeat(np.arange(1, len(detections) + 1, dtype=np.int64), [len(d.pos) for d in detections])
    vel = np.concatenate([d.vel for d in detections if d.vel is not None]) if moving else None
    box = np.concatenate([d.box for d in detections if d.box is not None]) if boxed else None
    columns: tables.Columns = {"frame": frame, axes: pos, "score": score, along(axes): vel, BOX: box}
    facts = {"plane": plane, "frames": len(detections), "fps": fps}
    rest = score_and_place(score, None if plane == "image" else with_ground_height(pos, scene))
    # An alarm at the picture's edge may be a box without width.
    shown = np.full((len(score), 4), np.nan) if box is None else np.c_[box[:, :2], np.maximum(box[:, 2:], 0.01)]
    text = mot_text(frame, np.full(len(frame), -1), shown, rest)
    units = tables.units_of("px" if plane == "image" else "m")
    return {"det/det.parquet": tables.table_bytes(columns, facts, units), "det/det.txt": text}


def scores_or_ones(score: Array, rows: int) -> Array:
    """Returns `score` if it has `rows` items, else ones (rows,), as for a detector without scores."""
    return score if len(score) == rows else np.ones(rows)


def with_ground_height(pos: Array, scene: Scene | None) -> Array:
    """Returns positions (N, 3) m; a 2-D position gets the height of the scene's ground as z."""
    if pos.shape[1] == 3:
        return pos
    z = np.zeros(len(pos)) if scene is None else height_at(scene, pos)
    return np.concatenate([pos, z[:, None]], axis=1)


def read_detections(path: Path) -> list[Detections]:
    """Returns the detections in a det.parquet, one Detections for each frame from 1."""
    table = read_table(path)
    axes = AXES if "z" in table.columns else AXES[:2]
    pos, score = table.floats(*axes), table.floats("score")
    facts = table.facts_as(plane=PLANES, frames=Count, fps=Rate)
    vel, box = table.known(*along(axes)), table.known(*BOX)
    found = []
    for k, r in enumerate(table.cuts(1, facts.frames)):
        cut = (pos[r], None if vel is None else vel[r], None if box is None else box[r], score[r])
        found.append(Detections(k + 1, k / facts.fps, facts.plane, *cut))
    return found


def owner_text(owners: list[Ints]) -> bytes:
    """Returns gt/det_ids.txt: for each row of det.txt the frame and the id of the person whom it shows, -1 for none."""
    return "".join(f"{k},{id}\n" for k, ids in enumerate(owners, 1) for id in ids.tolist()).encode()


def read_owners(folder: Path, detections: list[Detections]) -> list[Ints]:
    """Returns the ids (M,) in a det_ids.txt of the people whom the detections of each frame show, -1 for none."""
    path, counts = folder / "gt" / "det_ids.txt", [len(d.pos) for d in detections]
    rows = [line.split(",") for line in path.read_text(encoding="utf-8").splitlines()]
    frame = np.repeat(np.arange(1, len(counts) + 1), counts)
    if [row[0] for row in rows] != [str(k) for k in frame.tolist()] or any(len(row) != 2 for row in rows):
        got, expected = f"{len(rows)} rows", f"frame,id for each of the {len(frame)} rows of det.txt"
        raise InputError(file=path, got=got, expected=expected, remedy=REDO)
    return np.split(np.array([row[1] for row in rows], dtype=np.int64), np.cumsum(counts)[:-1])
