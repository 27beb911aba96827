"""Frames without labels are not scored where labels are clearly sparse, and are where nobody was there."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.types import Groups, Truth, Unscored
from tests.hand_made import with_rows
from tracking import track
from tracking.scoring import evaluate, score_arrays
from tracking.scoring.annotated_frames import annotated_frames
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.evaluation import Scorer

LENGTH = 600


def labelled_in(frames, people=(1, 2), length: int = LENGTH, **changes) -> Truth:
    """A truth whose people are labelled in these frames; `people` may give those of a frame as a function."""
    of = people if callable(people) else lambda frame: people
    rows = [(frame, id) for frame in frames for id in of(frame)]
    frame, id = np.array(rows, np.int64).reshape(-1, 2).T
    box = np.column_stack([100.0 * id, frame, np.full(len(id), 40), np.full(len(id), 100)])
    alone = np.full(len(id), -1)
    return Truth(
        "labels", 25.0, length, 60.0, frame, id, alone, None, None, box, np.ones(len(id)),
        labelled=np.zeros(length, bool), **changes,
    )  # fmt: skip


KEYFRAMES = np.unique(np.random.default_rng(5).choice(np.arange(1, LENGTH + 1), 37, replace=False))
JITTERED = np.round(np.arange(0, LENGTH, 12.5)).astype(int) + 1
SPARSE = {
    "every 10th frame": (range(1, LENGTH, 10), range(1, LENGTH + 1, 10), 10),
    "every 10th frame, from the 10th": (range(10, LENGTH, 10), range(10, LENGTH + 1, 10), 10),
    "every 2nd frame": (range(2, LENGTH, 2), range(2, LENGTH + 1, 2), 2),
    "once a second, four gaps": (
        sorted({*range(1, 600, 25)} - {51, 201, 351, 376}), range(1, LENGTH + 1, 25), 25,
    ),
    "keyframes at random": (KEYFRAMES, KEYFRAMES, None),
    "twice a second of 25 fps": (JITTERED, JITTERED, None),
    "every 10th frame and the last one": ([*range(1, LENGTH, 10), LENGTH], [*range(1, LENGTH, 10), LENGTH], None),
    "five frames": (range(1, 102, 25), range(1, LENGTH + 1, 25), 25),
}  # fmt: skip


@pytest.mark.parametrize("kind", SPARSE)
def test_sparse_labels_are_found(kind: str) -> None:
    frames, expected, step = SPARSE[kind]
    found = annotated_frames(labelled_in(frames))
    assert np.flatnonzero(found.frames).tolist() == list(expected)
    assert found.step == step


def test_rows_to_be_ignored_are_no_labels() -> None:
    ignored = Unscored(np.arange(1, LENGTH + 1), np.tile([0.0, 0, 40, 100], (LENGTH, 1)), np.zeros(LENGTH, bool))
    assert annotated_frames(labelled_in(range(1, LENGTH, 10), unscored=ignored)).step == 10


def visits(seed: int) -> list[int]:
    """The frames of people who come now and then for 2 to 40 frames."""
    r = np.random.default_rng(seed)
    starts = np.cumsum(r.integers(30, 120, 8))
    return sorted({f for s in starts for f in range(s, s + int(r.integers(2, 40))) if f <= LENGTH})


DENSE = {
    "all frames": (range(1, LENGTH + 1), (1, 2)),
    "nobody": ((), (1,)),
    "absent in the middle": ([*range(1, 100), *range(400, 600)], (1, 2)),
    "labels of the first half": (range(1, 300), (1, 2)),
    "hidden in every third frame": ([f for f in range(1, LENGTH) if f % 3], (1, 2)),
    "four frames": ((1, 101, 201, 301), (1, 2)),
    "strangers who come for one frame": ((3, 80, 85, 300, 302, 455, 500, 580), lambda frame: (frame,)),
    **{f"visits {seed}": (visits(seed), (1, 2)) for seed in range(4)},
}


@pytest.mark.parametrize("kind", DENSE)
def test_absent_people_are_no_sparse_labels(kind: str) -> None:
    frames, people = DENSE[kind]
    found = annotated_frames(labelled_in(frames, people))
    assert found.step == 1
    assert found.frames.sum() == LENGTH


@pytest.fixture(scope="module")
def merge() -> tuple[Truth, tuple]:
    """A scene with a merge, and the tracks of a tracker in it."""
    sequence = simulate(load("merge"), 5)
    run = track("blob", sequence, detections="file")
    return sequence.truth, run.tracks


def thinned(dense: Truth, frames: np.ndarray) -> Truth:
    """A truth whose labels of people and groups stand in these frames only."""
    flags, nobody = np.isin(np.arange(1, dense.length + 1), frames), Groups.none()
    groups = {
        name: tuple(g if f else nobody for g, f in zip(getattr(dense, name), flags, strict=True))
        for name in ("groups", "groups_px")
    }
    return with_rows(dense, np.isin(dense.frame, frames), visible_box=None, labelled=flags, **groups)


@pytest.mark.parametrize("step", [2, 5, 10])
def test_sparse_labels_score_as_these_frames_of_both_sides(merge: tuple[Truth, tuple], step: int) -> None:
    dense, run = merge
    frames = range(1, dense.length + 1, step)
    sparse = thinned(dense, np.array(frames))
    found, expected = evaluate(sparse, run), evaluate(dense, run, frames=frames)
    assert dict(found) == pytest.approx(dict(expected), nan_ok=True)
    assert (found.frames, found.length, found.step) == (len(frames), dense.length, step)
    assert (expected.frames, expected.step) == (len(frames), 1)
    assert found["MOTA"] > 0.5 > 1 - step * 0.9
    assert found["merge_F1"] == evaluate(dense, run)["merge_F1"]
    known = {key: found[key] for key in ("HOTA", "group_F1", "objective")}
    assert Scorer(sparse).compare([run])[0].objective_scores() == known
    weighted = Scorer(sparse).compare([run])[0].weighted_scores("hull")(np.ones((1, dense.length)))[0]
    assert dict(zip(CATALOGUE, weighted, strict=True)) == pytest.approx(dict(found), nan_ok=True)


def columns(t: Truth, group: bool = True, step: int = 1, frames: int = 1) -> dict:
    """The rows of every `step`-th frame as columns, these frames numbered 1, 1 + frames, …"""
    kept = (t.frame - 1) % step == 0
    number = (t.frame[kept] - 1) // step * frames + 1
    table = {"frame": number, "id": t.id[kept], "pos": t.pos[kept]}
    return table | ({"group": t.group[kept]} if group else {})


@pytest.mark.parametrize("grouped", [True, False])
def test_sparse_arrays_score_as_these_frames_numbered_anew(merge: tuple[Truth, tuple], grouped: bool) -> None:
    """Labels in every 5th frame of 10 frames/s, and tracks there: the same as 2 frames/s, events and groups too."""
    dense, _ = merge
    moved = dense.replace(pos=dense.pos + np.random.default_rng(3).normal(0, 0.1, dense.pos.shape))
    anew = score_arrays(columns(dense, step=5), columns(moved, grouped, step=5), fps=2)
    found = score_arrays(columns(dense, step=5, frames=5), columns(moved, grouped, step=5, frames=5), fps=10)
    assert (anew.step, found.step, found.frames) == (1, 5, anew.frames)
    assert dict(found) == pytest.approx(dict(anew), nan_ok=True)
    assert found["event_F1"] == found["event_F1"]
