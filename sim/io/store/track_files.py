"""The tracks of a run as files: tracks.parquet (exact), tracks.txt and tracks.mot.txt (MOTChallenge), groups, events.

tracks.txt has 10 columns `frame,id,left,top,width,height,conf,x,y,z`. A missing box is -1,-1,-1,-1; a z of -1 means
that the ground position is unknown. tracks.mot.txt has the first 7 columns, because TrackEval reads column 8 as class.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError
from sim.io.files import tables
from sim.io.files.atomic import replace_files
from sim.io.files.tables import Column, StoredTable, table_bytes
from sim.io.formats.mot_text import ground_cells
from sim.io.store.event_files import event_dict, read_events
from sim.io.store.group_files import AXES, groups_bytes, groups_csv, read_groups
from sim.io.store.track_boxes import box_source, upright_boxes
from sim.io.store.track_text import read_track_text, with_groups
from sim.io.store.truth_files import BOX, scores_or_ones, with_ground_height
from sim.types import Array, Bools, Camera, GroupEvent, Scene, Tracks

NAMES = ("tracks.txt", "tracks.mot.txt", "tracks.parquet", "groups.csv", "groups.parquet", "events.json", "run.json")


def write_tracks(
    folder: str | Path,
    tracks: Iterable[Tracks],
    *,
    fps: float,
    camera: Camera | None = None,
    scene: Scene | None = None,
    info: dict[str, Any] | None = None,
) -> Path:
    """Write the tracks of consecutive frames of one tracker into `folder`, and return the folder.

    Files: tracks.parquet, tracks.txt, tracks.mot.txt, groups.parquet and groups.csv if there are groups, events.json,
    and run.json last. Files of these names from an earlier run are replaced or deleted, others stay. tracks: one Tracks
    per frame, all of one plane and unit (else AssertionError). fps: frames/s. camera: if the tracker gives no boxes,
    tracks of people on the ground or in space get the boxes of upright people in the texts; None: no such boxes. scene:
    gives the height of the ground under 2-D positions; None: 0. info: content of run.json, to which "format" and
    "boxes" (where the boxes come from: "measured", "projected" or "none") are added.

    Raises InputError if the folder cannot be written, WorkError if the disk is full, ValueError if `info` holds NaN or
    infinity, TypeError if it holds what JSON cannot.
    """
    folder = Path(folder)
    replace_files(folder, tracks_files(tracks, fps=fps, camera=camera, scene=scene, info=info), stale=NAMES)
    return folder


def tracks_files(
    tracks: Iterable[Tracks],
    *,
    fps: float,
    camera: Camera | None = None,
    scene: Scene | None = None,
    info: dict[str, Any] | None = None,
) -> dict[str, bytes]:
    """Return the files of one tracker's tracks, as `write_tracks` writes them: content by name, run.json last.

    Names: tracks.parquet, tracks.txt, tracks.mot.txt, groups.parquet and groups.csv if a frame has groups, events.json,
    run.json. tracks: one Tracks per frame, of consecutive frames, all of one plane and unit (else AssertionError). fps:
    frames/s. camera: gives people without boxes those of upright people; None: no such boxes. scene: gives the height
    of the ground; None: 0. info: content of run.json, to which "format" and "boxes" are added.

    Nothing is written. No tracks give tables without rows, in the plane "ground". Raises ValueError if `info` holds NaN
    or infinity, TypeError if it holds what JSON cannot.
    """
    every = list(tracks)
    rows, boxes = _flatten(every, fps), box_source(every, camera)
    text_box, place = rows.box, None if rows.plane == "image" else with_ground_height(rows.pos, scene)
    if boxes == "projected" and camera is not None and place is not None:
        text_box = upright_boxes(camera, place)
    files = {
        "tracks.parquet": _table(rows, every, fps),
        "tracks.txt": _text(rows, text_box, place, full=True),
        "tracks.mot.txt": _text(rows, text_box, place, full=False),
    }
    first = every[0].index if every else 1
    groups = [t.groups for t in every]
    if any(g is not None for g in groups):
        files["groups.parquet"] = groups_bytes(groups, first, "px" if rows.plane == "image" else "m")
        files["groups.csv"] = groups_csv(groups, None, first)
    events = [{**event_dict(e), "frame": t.index} for t in every for e in t.events]
    files["events.json"] = tables.json_list("events", events)
    files["run.json"] = tables.json_document({"format": tables.FORMAT, **(info or {}), "boxes": boxes})
    return files


@dataclass(frozen=True)
class _Rows:
    """The tracks of all frames of one tracker, R rows in the order of frames.

    plane, unit: of all tracks. frame (R,): from the tracks' index, from 1. id, group (R,): of the track and of its
    group, -1 for alone. pos, vel (R, D) m or px (per s), D = 3 in the plane "space", else 2. cov (R, 2D, 2D):
    covariance of position and velocity. box (R, 4): left, top, width, height in px, nan in a frame without boxes.
    boxless (R,): True in such a frame. score (R,): 1 if the tracker gives none.
    """

    plane: str
    unit: str
    frame: Any
    id: Any
    group: Any
    pos: Array
    vel: Array
    cov: Array
    box: Array
    boxless: Any
    score: Array


def _flatten(every: list[Tracks], fps: float) -> _Rows:
    kinds = {(t.plane, t.unit) for t in every}
    assert len(kinds) <= 1, f"a tracker stays in one plane and unit: {sorted(kinds)}"
    plane, unit = next(iter(kinds), ("ground", "person"))
    d = 3 if plane == "space" else 2
    counts = [len(t.id) for t in every]

    def join(parts: list[Any], empty: Any) -> Any:
        return np.concatenate([empty, *parts])

    ids = np.zeros(0, np.int64)
    no_box = [np.full((len(t.id), 4), np.nan) if t.box is None else t.box for t in every]
    return _Rows(
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


def _table(rows: _Rows, every: list[Tracks], fps: float) -> bytes:
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


def _text(rows: _Rows, box: Array, place: Array | None, *, full: bool) -> bytes:
    boxed: Bools = np.asarray(np.isfinite(box).all(axis=1) & (box[:, 2:] > 0).all(axis=1))
    places = [[np.nan] * 3] * len(rows.id) if place is None else place.tolist()
    placed: Bools = np.asarray(np.isfinite(np.reshape(places, (-1, 3))).all(axis=1))
    lines = []
    for k, (frame, id, score) in enumerate(
        zip(rows.frame.tolist(), rows.id.tolist(), rows.score.tolist(), strict=True)
    ):
        left, top, width, height = box[k].tolist()
        corner = f"{left:.2f},{top:.2f},{max(width, 0.01):.2f},{max(height, 0.01):.2f}" if boxed[k] else "-1,-1,-1,-1"
        where = ground_cells(places[k]) if placed[k] else "-1,-1,-1"
        lines.append(f"{frame},{id},{corner},{score:.4f}" + (f",{where}\n" if full else "\n"))
    return "".join(lines).encode()


def read_tracks(path: str | Path, *, fps: float | None = None, length: int | None = None) -> list[Tracks]:
    """Read the tracks of a folder that write_tracks wrote, of one of its files, or of another program's MOT text.

    Returns one Tracks per frame. tracks.parquet is read if it exists, and is exact. From text, velocities are
    differences over 0.5 s, covariances nan, and everybody is alone; beside our own tracks.txt, groups and events are
    those of groups.csv and events.json, and boxes are left out if run.json says that they were projected. fps (None:
    25) and length (None: to the last frame in the file) apply to text only; `length` adds empty frames at the end. An
    event belongs to the frame that reported it; if that is not stored, to the frame in which it was emitted, else to
    its end.

    Raises InputError if there are no tracks, a file is unreadable or invalid, a frame is beyond `length`, or an event's
    frame is outside the tracks. Warns about a text without rows if `length` is given.
    """
    path = Path(path)
    folder = path if path.is_dir() else path.parent
    exact = path if path.suffix == ".parquet" else folder / "tracks.parquet"
    ours = path.is_dir() or path.name in ("tracks.txt", "tracks.parquet")
    if ours and exact.is_file():
        return _with_events(_exact(exact, folder), folder)
    text = folder / "tracks.txt" if path.is_dir() else path
    if not text.is_file():
        raise InputError(
            file=path, got="no tracks", expected="tracks.parquet, tracks.txt or a MOTChallenge text",
            remedy="give the folder that `flockscope track` made",
        )  # fmt: skip
    projected = ours and (folder / "run.json").is_file() and _boxes(folder / "run.json") == "projected"
    found = read_track_text(text, 25.0 if fps is None else fps, length, projected=projected)
    if not ours:
        return found
    groups = folder / "groups.csv"
    return _with_events(with_groups(found, groups) if groups.is_file() else found, folder)


def _boxes(path: Path) -> Any:
    """Return the value "boxes" of the run.json `path` ("measured", "projected" or "none"), None if missing.

    Raises InputError if the file is unreadable, no JSON object or of another format number.
    """
    return tables.read_document(path).get("boxes")


def _exact(path: Path, folder: Path) -> list[Tracks]:
    table, groups_path = tables.read_table(path), folder / "groups.parquet"
    derived = bool(table.facts.get("derived", False)) and (folder / "events.json").is_file()
    plane, fps = table.fact("plane"), float(table.fact("fps"))
    first, count, boxless = int(table.fact("first")), int(table.fact("frames")), set(table.fact("boxless"))
    state = _state(plane)
    d = len(state) // 2
    values, cov = table.floats(*state), table.floats(*(f"cov_{a}_{b}" for a in state for b in state))
    cov, box, score = cov.reshape(-1, 2 * d, 2 * d), table.floats(*BOX), table.floats("score")
    id, group = table.ints("id"), table.ints("group")
    groups = read_groups(tables.read_table(groups_path)) if groups_path.is_file() else [None] * count
    cuts = _cuts(table, first, count)
    found = []
    for k in range(count):
        index, r = first + k, slice(int(cuts[k]), int(cuts[k + 1]))
        found.append(
            Tracks(
                index, (index - 1) / fps, plane, table.fact("unit"), id[r], group[r], values[r, :d], values[r, d:],
                cov[r], None if index in boxless else box[r], score[r], groups[k],
                derived=derived,
            )
        )  # fmt: skip
    return found


def _cuts(table: StoredTable, first: int, count: int) -> Any:
    frame = table.ints("frame")
    if len(frame) and (frame.min() < first or frame.max() >= first + count or (np.diff(frame) < 0).any()):
        wanted = f"frames {first} to {first + count - 1}, in order"
        raise InputError(file=table.file, place="frame", got="other frames", expected=wanted, remedy=tables.REDO)
    return np.searchsorted(frame, np.arange(first, first + count + 1))


def _with_events(found: list[Tracks], folder: Path) -> list[Tracks]:
    path = folder / "events.json"
    if not path.is_file():
        return found
    first, last = (found[0].index, found[-1].index) if found else (1, 0)
    by_frame: dict[int, list[GroupEvent]] = {}
    for k, (event, frame) in enumerate(read_events(path)):
        at = next(index for index in (frame, event.emitted, event.end) if index is not None)
        if not first <= at <= last:
            raise InputError(
                file=path, place=f"events[{k}]", got=f"an event reported in frame {at}",
                expected=f"a frame from {first} to {last}, as the tracks have", remedy="correct the event",
            )  # fmt: skip
        by_frame.setdefault(at, []).append(event)
    return [t.replace(events=tuple(by_frame[t.index])) if t.index in by_frame else t for t in found]
