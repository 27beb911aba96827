"""Tracks in parts: joined they are the run written whole, and a run killed at any moment loses its last part only."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.store import atomic, track_parts
from sim.store.atomic import lock_folder
from sim.store.seal import RUN, check_run
from sim.store.track_files import read_run, tracks_files
from sim.store.track_parts import TrackParts, has_parts, join_parts, read_parts
from sim.types import Groups, Tracks
from tests.made_up import make_tracks, same

INFO = {"tracker": "blob", "live": True, "fps": 10.0}


class Killed(BaseException):
    """Ends a run as SIGKILL would: nothing catches it, and nothing is cleaned up."""


def kill_at(monkeypatch, n: int) -> None:
    """Lets the n-th change of the disk from now on, and all after it, fail."""
    left = [n]

    def counted(call):
        def change(*given, **more):
            left[0] -= 1
            if left[0] < 0:
                raise Killed
            return call(*given, **more)

        return change

    for name in ("replace", "unlink", "mkdir", "rmdir"):
        monkeypatch.setattr(os, name, counted(getattr(os, name)))
    monkeypatch.setattr(atomic, "write_inside", counted(atomic.write_inside))


def write(folder: Path, tracks: list[Tracks], each: int = 3) -> Path:
    """Writes the tracks in parts of so many frames."""
    with lock_folder(folder):
        parts = TrackParts(folder, 10.0)
        for k in range(0, len(tracks), each):
            parts.add(tracks[k : k + each], {**INFO, "frames": k + each}, now=True)
        return parts.finish(INFO)


def whole(tracks: list[Tracks]) -> dict[str, bytes]:
    return {name: body for name, body in tracks_files(tracks, fps=10.0).items() if name != RUN}


def files(folder: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in folder.iterdir() if p.is_file() and p.name != RUN}


@pytest.mark.parametrize("each", [1, 3, 100])
@pytest.mark.parametrize("boxed", [True, False])
def test_joined_parts_are_the_run_written_whole(tmp_path, each, boxed):
    tracks = make_tracks(0, 40, boxed=boxed)
    write(tmp_path / "run", tracks, each)
    assert files(tmp_path / "run") == whole(tracks)
    assert not (tmp_path / "run" / "parts").exists()
    assert check_run(tmp_path / "run")["frames"] == 40


def test_many_parts_are_made_few(tmp_path, monkeypatch):
    monkeypatch.setattr(track_parts, "JOINED", 5)
    tracks = make_tracks(0, 23)
    with lock_folder(tmp_path):
        parts = TrackParts(tmp_path, 10.0)
        for k, t in enumerate(tracks, 1):
            parts.add([t], INFO, now=True)
            assert len(list((tmp_path / "parts").iterdir())) == k // 5 + k % 5
        parts.finish(INFO)
    assert files(tmp_path) == whole(tracks)


@pytest.mark.slow
def test_a_run_killed_between_any_two_changes_of_the_disk_keeps_all_but_its_last_part(tmp_path, monkeypatch):
    """The parts are joined twice, and made one at the end. Each is killed, too. Every seventh change is tried."""
    monkeypatch.setattr(track_parts, "JOINED", 3)
    tracks, seen = make_tracks(0, 14), set()
    for n in range(0, 5000, 7):
        folder, added = tmp_path / f"{n}", [0]
        folder.mkdir()
        with monkeypatch.context() as patched, suppress(Killed):
            patched.setattr(TrackParts, "add", noting(TrackParts.add, added))
            kill_at(patched, n)
            write(folder, tracks, 2)
            break
        kept = stored(folder)
        assert len(kept) >= added[0], f"killed at change {n}"
        same(kept, tracks[: len(kept)])
        seen.add(len(kept))
    assert {0, 2, 6, 12, 14} <= seen


def noting(add, added):
    """Notes how many frames were stored when `add` returned."""

    def noted(self, tracks, info, *, now=False):
        add(self, tracks, info, now=now)
        added[0] += len(tracks)

    return noted


def stored(folder: Path) -> list[Tracks]:
    """What a reader finds in a folder."""
    if has_parts(folder):
        if not read_parts(folder)[0]:
            with pytest.raises(InputError, match="before tracks were stored"):
                join_parts(folder)
            return []
        join_parts(folder)
    if not (folder / RUN).is_file():
        return []
    check_run(folder)
    return read_run(folder)


def test_first_frames_without_people_get_the_plane_of_those_after(tmp_path):
    """A tracker that knows its plane once it sees somebody."""
    tracks = [t.replace(events=()) for t in make_tracks(0, 6)]
    nobody = tracks[0].replace(plane="image", groups=Groups.none()).keep(np.zeros(len(tracks[0].id), bool))
    begun = [nobody.replace(index=k, t=(k - 1) / 10) for k in (1, 2)]
    write(tmp_path / "run", [*begun, *tracks[2:]], 1)
    assert {t.plane for t in read_run(tmp_path / "run")} == {"ground"}
    assert [t.index for t in read_run(tmp_path / "run")] == list(range(1, 7))


def test_first_frames_without_people_are_joined_with_those_after(tmp_path, monkeypatch):
    monkeypatch.setattr(track_parts, "JOINED", 3)
    test_first_frames_without_people_get_the_plane_of_those_after(tmp_path)


def test_the_last_frame_can_be_given_anew(tmp_path):
    tracks = make_tracks(0, 5)
    last = tracks[-1].replace(events=())
    with lock_folder(tmp_path):
        parts = TrackParts(tmp_path, 10.0)
        parts.add(tracks, INFO, now=True)
        parts.finish(INFO, last)
    assert files(tmp_path) == whole([*tracks[:-1], last])


def test_parts_are_written_every_quarter_of_a_second(tmp_path, monkeypatch):
    clock = [0.0]
    monkeypatch.setattr(track_parts.time, "monotonic", lambda: clock[0])
    parts = TrackParts(tmp_path, 10.0)
    for k, t in enumerate(make_tracks(0, 25)):
        clock[0] = k / 10
        parts.add([t], INFO)
    assert [p.name for p in sorted((tmp_path / "parts").iterdir())] == [
        "0000001", "0000005", "0000008", "0000011", "0000014", "0000017", "0000020", "0000023",
    ]  # fmt: skip
    assert len(read_parts(tmp_path)[0]) == 25


def test_a_run_in_progress_is_not_put_together(tmp_path):
    with lock_folder(tmp_path):
        TrackParts(tmp_path, 10.0).add(make_tracks(0, 3), INFO, now=True)
    descriptor = atomic._locked(tmp_path)
    try:
        with pytest.raises(InputError, match="another run"):
            join_parts(tmp_path)
    finally:
        atomic.os.close(descriptor)
    assert join_parts(tmp_path)["frames"] == 3


def test_a_folder_of_somebody_else_is_not_touched(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "engine.txt").write_text("mine")
    assert not has_parts(tmp_path)
    with pytest.raises(InputError, match="another program"):
        TrackParts(tmp_path, 10.0)
    assert (tmp_path / "parts" / "engine.txt").read_text() == "mine"


def test_a_new_run_replaces_one_that_was_finished(tmp_path):
    write(tmp_path, make_tracks(0, 9))
    write(tmp_path, make_tracks(0, 4))
    assert len(read_run(tmp_path)) == 4


def test_a_lost_part_ends_what_is_put_together(tmp_path):
    with lock_folder(tmp_path):
        parts = TrackParts(tmp_path, 10.0)
        for t in make_tracks(0, 6):
            parts.add([t], INFO, now=True)
    (tmp_path / "parts" / "0000004" / RUN).unlink()
    assert join_parts(tmp_path)["frames"] == 3
