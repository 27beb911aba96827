"""The tracks of a run, or of another program's text (MOTChallenge or KITTI).

Positions of a text are those on the ground (m) if the file has them, else the centres of the boxes (px). Velocities are
differences over 0.5 s.
"""

from __future__ import annotations

import warnings
from functools import lru_cache
from itertools import pairwise
from pathlib import Path

import numpy as np

from scenarios.errors import InputError, reject
from scenarios.limits import FRAMES
from sim.geometry.boxes import centres
from sim.store import group_files
from sim.store.seal import WHOLE, check_run, run_folder
from sim.store.track_files import read_run, with_events
from sim.truth.velocities import chords
from sim.types import Array, Groups, Ints, Plane, Tracks
from tracking.recordings import mot_text, people_texts
from tracking.recordings.mot_table import read_table, require_pixels, table_of_rows
from tracking.recordings.mot_text import of_class, unit_scores
from tracking.recordings.options import BoxScale, Classes


def read_tracks(path: str | Path, *, fps: float | None = None, length: int | None = None) -> list[Tracks]:
    """Reads the tracks of a run, or of another program's MOTChallenge text.

    Args:
        path: A folder that `write_tracks` wrote, a file of it, or a text. Of a text, velocities are differences over
            0.5 s, covariances nan, and everybody is alone. Beside a tracks.txt, groups.csv and events.json are read.
        fps: Frames per second of a text; None: 25.
        length: Frames of a text; None: to the last frame in the file.

    Returns:
        One Tracks per frame, each with the events reported in this frame. An event stored without that frame is put
        in the frame `emitted`, else in its last frame.

    Raises:
        InputError: There are no tracks, or they are unfinished, damaged, invalid or mixed with those of another run.
    """
    folder = run_folder(Path(path))
    if folder is not None:
        check_run(folder)
    return read_checked_tracks(path, fps=fps, length=length)


def read_checked_tracks(
    path: str | Path, *, fps: float | None = None, length: int | None = None, person_class: Classes | None = None,
    box_scale: BoxScale | None = None, px_per_m: float | None = None, begin: float = 0.0,
) -> list[Tracks]:  # fmt: skip
    """Reads tracks as `read_tracks` does, but does not check the files of a run against their hashes."""
    path = Path(path)
    folder = path if path.is_dir() else path.parent
    whole = path.is_dir() or path.name in WHOLE
    if whole and run_folder(path) is not None:
        return read_run(folder)
    text = folder / "tracks.txt" if path.is_dir() else path
    expected = "tracks.parquet, tracks.txt or a MOTChallenge text"
    reject(not text.is_file(), path, "no tracks", expected, "give the folder that `flockscope track` made")
    found = read_track_text(text, 25.0 if fps is None else fps, length, person_class, box_scale, px_per_m, begin)
    if not whole:
        return found
    groups = folder / "groups.csv"
    return with_events(with_groups(found, groups) if groups.is_file() else found, folder)


def read_track_text(
    path: Path, fps: float, length: int | None, person_class: Classes | None = None, box_scale: BoxScale | None = None,
    px_per_m: float | None = None, begin: float = 0.0,
) -> list[Tracks]:  # fmt: skip
    """Returns the tracks of a text of MOTChallenge or KITTI, one Tracks per frame from 1 to `length`, sorted by id.

    length: None: to the last frame in the file. person_class: only rows of these classes are read; None: people.
    box_scale: factors of x and y that make the boxes pixels. px_per_m: pixels per metre of positions in px. begin: time
    of frame 1, s, for a column of times. A column of groups makes them the tracker's own.
    """

    def frames_at(seconds: Array, _: Array) -> Ints:
        frame = mot_text.frames_of_times(seconds, begin, fps)
        early = frame < 1
        if len(frame) and (early | (frame > (length or FRAMES))).mean() > 0.5:
            got, expected = f"{seconds.min():.15g} to {seconds.max():.15g} s", f"times from {begin:.15g} s on"
            remedy = "give seconds since the first frame, or numbers of frames in a column frame"
            raise InputError(file=path, place="times", got=got, expected=expected, remedy=remedy)
        if early.any():
            warnings.warn(f"{path}: {early.sum()} rows before the first frame are left out", stacklevel=4)
        return np.maximum(frame, 0)

    if people_texts.layout_of(path) == "kitti":
        table = table_of_rows(people_texts.kitti_tracks(path, person_class), length, box_scale, boxless=False)
    else:
        table = read_table(path, length=length, box_scale=box_scale, frames_at=frames_at, px_per_m=px_per_m)
    require_pixels(table.rows, table.boxes())
    if not len(table.frame):
        if length is None:
            raise InputError(file=path, got="no row", expected="tracks", remedy="check that it was written")
        warnings.warn(f"{path}: no row, so nobody was tracked", stacklevel=3)
    most = "these are detections: `flockscope track` them first"
    table.rows.reject(table.id < 0, "ids from 0", "give each track an id", most)
    people = of_class(table, np.ones(len(table.id), bool), person_class)
    mot_text.reject_duplicate_ids(table, people)
    order = np.lexsort((table.id, table.frame))
    order = order[people[order]]
    frame, id = table.frame[order], table.id[order]
    mot_text.require_metres(table, fps)
    ground = mot_text.ground_positions(table)
    if ground is not None:
        remedy = "complete the line, or write z = -1 in all"
        table.rows.reject(np.isnan(ground[:, 0]), "a ground position (z other than -1), as in other lines", remedy)
    else:
        table.rows.reject(table.without_box(), "a box, or a ground position in every line", "complete the lines")
    pos = (centres(table.box) if ground is None else ground[:, :2])[order]
    box = None if table.without_box().any() else table.box[order]
    score = unit_scores(table.scores())[0][order]
    plane: Plane = "image" if ground is None else "ground"
    group = np.full(len(order), -1, np.int64) if table.group is None else table.group[order]
    vel, count = chords(frame, id, pos, fps), length or int(frame.max(initial=0))
    cuts = np.searchsorted(frame, np.arange(1, count + 2)).tolist()

    @lru_cache(maxsize=1)  # most frames of sparse texts are empty: they share their arrays
    def tracks(a: int, b: int) -> Tracks:
        some = (id[a:b], group[a:b], pos[a:b], vel[a:b], np.full((b - a, 4, 4), np.nan))
        nobody = table.group is not None and (group[a:b] < 0).all()  # Of a frame with groups they follow from `group`.
        groups = Groups.none() if nobody else None
        return Tracks(1, 0.0, plane, "person", *some, None if box is None else box[a:b], score[a:b], groups)

    return [tracks(a, b).replace(index=k + 1, t=k / fps) for k, (a, b) in enumerate(pairwise(cuts))]


def with_groups(found: list[Tracks], path: Path) -> list[Tracks]:
    """Returns the tracks of `found` with the groups of the file `path` (groups.csv) filled in.

    A person listed in two groups of a frame gets the group with the higher id. Members without a track are kept.
    """
    made = list[Tracks]()
    for tracks, groups in zip(found, group_files.read_groups_csv(path, len(found)), strict=True):
        group = tracks.group.copy()
        for name, members in zip(groups.id, groups.members, strict=True):
            group[np.isin(tracks.id, members)] = name
        made.append(tracks.replace(group=group, groups=groups))
    return made
