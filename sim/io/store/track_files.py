"""The tracks of a run as files: tracks.parquet (exact), tracks.txt and tracks.mot.txt (MOTChallenge), groups, events.

tracks.txt has 10 columns `frame,id,left,top,width,height,conf,x,y,z`. A missing box is -1,-1,-1,-1; a z of -1 means
that the ground position is unknown. tracks.mot.txt has the first 7 columns, because TrackEval reads column 8 as class.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError
from sim.io.files import tables
from sim.io.files.atomic import replace_sealed
from sim.io.files.lock import hold_lock
from sim.io.formats.box_columns import BoxScale
from sim.io.formats.mot_text import ground_cells
from sim.io.store.event_files import event_dict, read_events
from sim.io.store.group_files import groups_bytes, groups_csv
from sim.io.store.run_seal import EXACT, NAMES, PAIRS, RUN, WHOLE, check_run, reject_foreign, run_folder, sealed_run
from sim.io.store.track_boxes import box_source, upright_boxes
from sim.io.store.track_tables import RunRows, flatten, read_track_table, track_table
from sim.io.store.track_text import read_track_text, with_groups
from sim.io.store.truth_files import with_ground_height
from sim.types import Array, Bools, Camera, GroupEvent, Scene, Tracks


def write_tracks(
    folder: str | Path,
    tracks: Iterable[Tracks],
    *,
    fps: float,
    camera: Camera | None = None,
    scene: Scene | None = None,
    info: dict[str, Any] | None = None,
    pairs: bytes | None = None,
) -> Path:
    """Writes the tracks of consecutive frames of one tracker into a folder; run.json comes last.

    Args:
        folder: Where. Files of an earlier run are replaced; others stay.
        tracks: One Tracks per frame, all of one plane and unit.
        fps: Frames per second.
        camera: People on the ground or in space whose tracker gives no boxes get those of upright people in the texts.
        scene: Gives the height of the ground under 2-D positions; None: 0.
        info: Content of run.json, to which "format", "boxes", "files" and "sha256" are added.
        pairs: Content of pairs.parquet (`pair_table`); None: no such file.

    Returns:
        The folder.

    Raises:
        InputError: Tracks or `info` are wrong, or a file of others, or a stored sequence, is in the way.
    """
    folder = Path(folder)
    files = tracks_files(tracks, fps=fps, camera=camera, scene=scene, info=info, pairs=pairs)
    with hold_lock(folder):
        reject_foreign(folder)
        replace_sealed(folder, files, RUN, NAMES)
    return folder


def tracks_files(
    tracks: Iterable[Tracks],
    *,
    fps: float,
    camera: Camera | None = None,
    scene: Scene | None = None,
    info: dict[str, Any] | None = None,
    pairs: bytes | None = None,
) -> dict[str, bytes]:
    """Returns the files of one tracker's tracks, as `write_tracks` writes them: content by name, run.json last."""
    every = list(tracks)
    rows, boxes = flatten(every), box_source(every, camera)
    rows.reject_faults("tracks", "correct the tracker")
    text_box, place = rows.box, None if rows.plane == "image" else with_ground_height(rows.pos, scene)
    if boxes == "projected" and camera is not None and place is not None:
        text_box = upright_boxes(camera, place)
    files = {
        EXACT: track_table(rows, every, fps),
        "tracks.txt": _text(rows, text_box, place, full=True),
        "tracks.mot.txt": _text(rows, text_box, place, full=False),
    }
    first = every[0].index if every else 1
    groups = [t.groups for t in every]
    if any(g is not None for g in groups):
        files["groups.parquet"] = groups_bytes(groups, first, "px" if rows.plane == "image" else "m")
        files["groups.csv"] = groups_csv(groups, None, first)
    if pairs is not None:
        files[PAIRS] = pairs
    events = [{**event_dict(e), "frame": t.index} for t in every for e in t.events]
    files["events.json"] = tables.json_list("events", events)
    return {**files, RUN: sealed_run({**(info or {}), "boxes": boxes}, files)}


def _text(rows: RunRows, box: Array, place: Array | None, *, full: bool) -> bytes:
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
    """Reads the tracks of a run, or of another program's MOTChallenge text.

    Args:
        path: A folder that `write_tracks` wrote, a file of it, or a text. Of a text, velocities are differences over
            0.5 s, covariances nan, and everybody is alone, but for groups.csv and events.json beside a tracks.txt.
        fps: Frames per second of a text; None: 25.
        length: Frames of a text; None: to the last frame in the file.

    Returns:
        One Tracks per frame. An event belongs to the frame that reported it, else to `emitted`, else to its end.

    Raises:
        InputError: There are no tracks, or they are unfinished, damaged, invalid or mixed with those of another run.
    """
    folder = run_folder(Path(path))
    if folder is not None:
        check_run(folder)
    return read_checked_tracks(path, fps=fps, length=length)


def read_checked_tracks(
    path: str | Path, *, fps: float | None = None, length: int | None = None, person_class: int | None = None,
    box_scale: BoxScale | None = None,
) -> list[Tracks]:  # fmt: skip
    """Reads tracks as `read_tracks` does, but compares no hash of a run again."""
    path = Path(path)
    folder = path if path.is_dir() else path.parent
    whole = path.is_dir() or path.name in WHOLE
    if whole and run_folder(path) is not None:
        return _with_events(read_track_table(folder), folder)
    text = folder / "tracks.txt" if path.is_dir() else path
    if not text.is_file():
        raise InputError(
            file=path, got="no tracks", expected="tracks.parquet, tracks.txt or a MOTChallenge text",
            remedy="give the folder that `flockscope track` made",
        )  # fmt: skip
    found = read_track_text(text, 25.0 if fps is None else fps, length, person_class, box_scale)
    if not whole:
        return found
    groups = folder / "groups.csv"
    return _with_events(with_groups(found, groups) if groups.is_file() else found, folder)


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
