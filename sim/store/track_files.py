"""The tracks of a run as files: tracks.parquet (exact), tracks.txt and tracks.mot.txt (MOTChallenge), groups, events.

tracks.txt has 10 columns `frame,id,left,top,width,height,conf,x,y,z`. A missing box is -1,-1,-1,-1; a z of -1 means
that the ground position is unknown. tracks.mot.txt has the first 7 columns, because TrackEval reads column 8 as class.
Boxes are the tracker's own if it gives any, else projections of upright people, if that can be. Tracks of other
programs are read from MOTChallenge text: positions on the ground (m) if the file has them, else the centres of the
boxes (px), and velocities from the last 0.5 s.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from scenarios.errors import InputError, reject
from sim.arrays import joined, repeated_ids
from sim.store import group_files, tables
from sim.store.atomic import lock_folder, replace_sealed
from sim.store.seal import EXACT, NAMES, PAIRS, RUN, reject_foreign, sealed_run
from sim.store.tables import AXES, BOX, PLANES, Count, Rate, along, table_bytes, units_of
from sim.store.track_boxes import box_source, upright_boxes
from sim.store.truth_files import mot_text, score_and_place, scores_or_ones, with_ground_height
from sim.types import Array, Camera, GroupEvent, Groups, Ints, Scene, Tracks


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
    seen: Any  # (R,) False for people who are predicted only

    def reject_faults(self, file: object, remedy: str) -> None:
        """Raises InputError for the first wrong id, group or number, with its frame. file, remedy: for the message."""
        for wrong, got, expected in self._checks():
            if wrong.any():
                place = "frame {}, id {}".format(*(rows[np.argmax(wrong)] for rows in (self.frame, self.id)))
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
    """Returns the rows of the Tracks of all frames of one tracker; for an empty list zero rows in plane "ground"."""
    kinds = {(t.plane, t.unit) for t in every}
    assert len(kinds) <= 1, f"a tracker stays in one plane and unit: {sorted(kinds)}"
    plane, unit = next(iter(kinds), ("ground", "person"))
    d = 3 if plane == "space" else 2
    counts = [len(t.id) for t in every]
    return RunRows(
        plane, unit, np.repeat(np.array([t.index for t in every], np.int64), counts),
        joined((t.id for t in every), kind=np.int64), joined((t.group for t in every), kind=np.int64),
        joined((t.pos for t in every), d), joined((t.vel for t in every), d),
        joined((t.cov for t in every), 2 * d, 2 * d),
        joined((np.full((len(t.id), 4), np.nan) if t.box is None else t.box for t in every), 4),
        np.repeat(np.array([t.box is None for t in every], bool), counts),
        joined(scores_or_ones(t.score, len(t.id)) for t in every), joined((t.measured for t in every), kind=bool),
    )  # fmt: skip


def _columns(plane: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Returns the names of the columns of position and velocity, and of their covariance."""
    axes = AXES if plane == "space" else AXES[:2]
    state = (*axes, *along(axes))
    return state, tuple(f"cov_{a}_{b}" for a in state for b in state)


def track_table(rows: RunRows, every: list[Tracks], fps: float) -> bytes:
    """Returns the content of tracks.parquet, a row per track and frame. rows: `flatten(every)`. fps: frames/s."""
    state, cov = _columns(rows.plane)
    columns: tables.Columns = {
        "frame": rows.frame, "id": rows.id, "group": rows.group, state: np.concatenate([rows.pos, rows.vel], axis=1),
        BOX: rows.box, "score": rows.score, "seen": rows.seen, cov: rows.cov.reshape(-1, len(cov)),
    }  # fmt: skip
    facts = {
        "plane": rows.plane, "unit": rows.unit, "fps": fps, "first": every[0].index if every else 1,
        "frames": len(every), "boxless": [t.index for t in every if t.box is None],
        "derived": bool(every) and all(t.derived for t in every),
    }  # fmt: skip
    return table_bytes(columns, facts, units_of("px" if rows.plane == "image" else "m"))


def pair_table(frame: Ints, a: Ints, b: Ints, probability: Array) -> bytes:
    """Returns the content of pairs.parquet: the probability that two people belong together, a row per pair and frame.

    frame (R,): from 1. a, b (R,): person ids. probability (R,): 0 to 1.
    """
    return table_bytes({"frame": frame, "a": a, "b": b, "probability": probability}, {}, {})


def read_track_table(folder: Path) -> list[Tracks]:
    """Returns the tracks of tracks.parquet in `folder`, one Tracks per frame, with groups but without events."""
    table = tables.read_table(folder / EXACT)
    f = table.facts_as(
        plane=PLANES, unit=Literal["person", "group"], fps=Rate, first=Count, frames=Count, boxless=set[int],
        derived=(bool, False),
    )  # fmt: skip
    state, cov = _columns(f.plane)
    d, values, frame = len(state) // 2, table.floats(*state), table.ints("frame")
    rows = RunRows(
        f.plane, f.unit, frame, table.ints("id"), table.ints("group"), values[:, :d], values[:, d:],
        table.floats(*cov).reshape(-1, 2 * d, 2 * d), table.floats(*BOX), np.isin(frame, list(f.boxless)),
        table.floats("score"), table.floats("seen") > 0 if "seen" in table.columns else np.ones(len(frame), bool),
    )  # fmt: skip
    rows.reject_faults(table.file, tables.REDO)
    groups, found = _groups(folder / "groups.parquet", f.first, f.frames), []
    for index, r in enumerate(table.cuts(f.first, f.frames), f.first):
        box = None if index in f.boxless else rows.box[r]
        made = Tracks(
            index, (index - 1) / f.fps, f.plane, f.unit, rows.id[r], rows.group[r], rows.pos[r], rows.vel[r],
            rows.cov[r], box, rows.score[r], groups[index - f.first], derived=f.derived, seen=rows.seen[r],
        )  # fmt: skip
        found.append(made)
    return found


def _groups(path: Path, first: int, count: int) -> list[Groups | None]:
    if not path.is_file():
        return [None] * count
    table = tables.read_table(path)
    stated = table.facts.get("first"), table.facts.get("frames")
    got, expected = f"groups of frames from {stated[0]}, {stated[1]} in all", f"from {first}, {count} in all"
    table.reject(stated != (first, count), "schema", got, expected)
    found = group_files.read_groups(table)
    for index, some in enumerate(found, first):
        if some is not None:
            once = len(np.unique(some.id)) == len(some.id) and some.id.min(initial=0) >= 0
            known = all(np.isfinite(place).all() for place in (some.pos, *some.hull))
            got = "a place that is NaN or infinite" if once else "a group below 0, or a second time"
            table.reject(not (once and known), f"frame {index}", got, "unique ids from 0 and finite places")
    return found


def write_tracks(
    folder: str | Path, tracks: Iterable[Tracks], *, fps: float, camera: Camera | None = None,
    scene: Scene | None = None, info: dict[str, Any] | None = None, pairs: bytes | None = None,
) -> Path:  # fmt: skip
    """Writes the tracks of consecutive frames of one tracker into a folder; run.json comes last.

    Args:
        folder: Folder to write. Files of an earlier run in it are replaced; other files stay.
        tracks: One Tracks per frame, all of one plane and unit.
        fps: Frames per second.
        camera: If no track has a box, people on the ground or in space get boxes of upright people in the texts.
        scene: Gives the height of the ground under 2-D positions; None: 0.
        info: Content of run.json, to which "format", "boxes", "files" and "sha256" are added.
        pairs: Content of pairs.parquet (`pair_table`); None: no such file.

    Returns:
        The folder.

    Raises:
        InputError: Tracks or `info` are wrong, or a foreign file or a stored sequence would be changed.
    """
    folder = Path(folder)
    files = tracks_files(tracks, fps=fps, camera=camera, scene=scene, info=info, pairs=pairs)
    with lock_folder(folder, held=True):
        reject_foreign(folder)
        replace_sealed(folder, files, RUN, NAMES)
    return folder


def tracks_files(
    tracks: Iterable[Tracks], *, fps: float, camera: Camera | None = None, scene: Scene | None = None,
    info: dict[str, Any] | None = None, pairs: bytes | None = None,
) -> dict[str, bytes]:  # fmt: skip
    """Returns the files of one tracker's tracks, as `write_tracks` writes them: content by name, run.json last."""
    every = list(tracks)
    rows, boxes = flatten(every), box_source(every, camera)
    rows.reject_faults("tracks", "correct the tracker")
    text_box, place = rows.box, None if rows.plane == "image" else with_ground_height(rows.pos, scene)
    if boxes == "projected" and camera is not None and place is not None:
        text_box = upright_boxes(camera, place)
    files = {
        EXACT: track_table(rows, every, fps),
        "tracks.txt": mot_text(rows.frame, rows.id, text_box, score_and_place(rows.score, place)),
        "tracks.mot.txt": mot_text(rows.frame, rows.id, text_box, (f"{score:.4f}" for score in rows.score.tolist())),
    }
    first = every[0].index if every else 1
    groups = [t.groups for t in every]
    if any(g is not None for g in groups):
        files["groups.parquet"] = group_files.groups_bytes(groups, first, "px" if rows.plane == "image" else "m")
        files["groups.csv"] = group_files.groups_csv(groups, None, first)
    if pairs is not None:
        files[PAIRS] = pairs
    events = [{**tables.plain(e), "frame": t.index} for t in every for e in t.events]
    files["events.json"] = tables.json_list("events", events)
    return {**files, RUN: sealed_run({**(info or {}), "boxes": boxes}, files)}


def read_run(folder: Path) -> list[Tracks]:
    """Returns the tracks of a run's folder with their events, one Tracks per frame; hashes are not checked."""
    return with_events(read_track_table(folder), folder)


def with_events(found: list[Tracks], folder: Path) -> list[Tracks]:
    """Returns the tracks with the events of events.json in `folder`, each in the frame that reports it."""
    path = folder / "events.json"
    if not path.is_file():
        return found
    first, last = (found[0].index, found[-1].index) if found else (1, 0)
    by_frame: dict[int, list[GroupEvent]] = {}
    for k, (event, frame) in enumerate(group_files.read_events(path)):
        at = next(index for index in (frame, event.emitted, event.end) if index is not None)
        got, expected = f"an event reported in frame {at}", f"a frame from {first} to {last}, as the tracks have"
        reject(not first <= at <= last, path, got, expected, "correct the event", f"events[{k}]")
        by_frame.setdefault(at, []).append(event)
    return [t.replace(events=tuple(by_frame[t.index])) if t.index in by_frame else t for t in found]
