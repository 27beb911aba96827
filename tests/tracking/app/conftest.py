"""A hand-made sequence: groups of 3 and 2 people merge and split, a stranger passes, another person stands alone."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from sim.types import Camera, Detections, Frame, GroupEvent, Near, Scene, Sequence, Stairs, Tracks, Truth
from tests import hand_made

FPS, LENGTH = 10.0, 160
MERGE, SPLIT = 50, 110
SCENE = Scene(
    size=np.array([16.0, 10.0]), walls=np.array([[[0, 9.5], [16, 9.5]], [[15.5, 0], [15.5, 9.5]]], float),
    pillars=np.array([[4.0, 2.0, 0.4]]), doors=np.array([[[9.0, 9.5], [10.2, 9.5]]]), service=np.array([[14.5, 8.5]]),
    stairs=(Stairs(np.array([11.0, 1.5]), np.array([13.0, 1.5]), 2.0, 1.0, 8, 1.0),),
)  # fmt: skip


@pytest.fixture(autouse=True)
def _no_progress(monkeypatch):
    """However slow the machine: stderr is for what goes wrong."""
    monkeypatch.setattr("tracking.app.progress.PATIENCE", 1e6)


def look_at() -> Camera:
    """From the south, 6 m high, 40 degrees down."""
    tilt = np.radians(40)
    rotation = np.array([[1, 0, 0], [0, -np.sin(tilt), -np.cos(tilt)], [0, np.cos(tilt), -np.sin(tilt)]])
    return Camera("pinhole", (640, 480), (500.0, 500.0), (320.0, 240.0), np.array([8.0, -8.0, 9.0]), rotation)


def boxes(camera: Camera, pos: np.ndarray) -> np.ndarray:
    """Boxes of upright people 1.7 m high and 0.5 m wide."""
    corners = [np.c_[pos + np.array([dx, 0]), np.full(len(pos), z)] for dx in (-0.25, 0.25) for z in (0, 1.7)]
    uv = []
    for xyz in corners:
        p = (xyz - camera.position) @ camera.rotation.T
        uv.append(p[:, :2] / p[:, 2:] * camera.focal_px + np.array(camera.centre_px))
    low, high = np.min(uv, axis=0), np.max(uv, axis=0)
    return np.c_[low, high - low]


def paths() -> np.ndarray:
    """(T, P, 2): nan where absent."""
    t = np.arange(LENGTH) / FPS
    a = np.c_[np.minimum(2 + 1.1 * t, 7.5 + 0.4 * t), np.full(LENGTH, 5.0)]
    b = np.c_[np.maximum(14 - 1.1 * t, a[:, 0] + 1.2), np.full(LENGTH, 5.6)]
    apart = np.maximum(0, t - (SPLIT - 10) / FPS)
    a = a + np.c_[0 * t, -0.7 * apart]
    b = b + np.c_[0.5 * apart, 0.6 * apart]
    place = [a, a + np.array([0, 0.7]), a + np.array([-0.2, 1.4]), b, b + np.array([0.1, 0.7])]
    stranger = np.c_[15 - 1.2 * t, 8.5 - 0.35 * t]
    stranger[(t < 1) | (t > 11)] = np.nan
    wait = np.c_[np.full(LENGTH, 3.0), 8 + 0.02 * np.sin(t)]
    return np.stack([*place, stranger, wait], axis=1)


def groups(k: int) -> dict[int, tuple[list[int], None]]:
    """Who is in which group in frame k: {group: (people, None)}."""
    if MERGE <= k < SPLIT:
        return {1: ([1, 2, 3, 4, 5], None)}
    return {1: ([1, 2, 3], None), (2 if k < MERGE else 3): ([4, 5], None)}


def scenes() -> list[hand_made.Scene]:
    return [
        hand_made.Scene({p: tuple(xy) for p, xy in enumerate(places, 1) if np.isfinite(xy[0])}, groups(k))
        for k, places in enumerate(paths(), 1)
    ]


@pytest.fixture
def truth() -> Truth:
    path = paths()
    frame, person = np.nonzero(np.isfinite(path[..., 0]))
    vel = np.nan_to_num(np.gradient(path, 1 / FPS, axis=0)[frame, person])
    events = (
        GroupEvent("enter", 11, 11, None, (), (-1,), (6,), (13.8, 8.1)),
        GroupEvent("merge", MERGE, MERGE + 20, None, (1, 2), (1,), (1, 2, 3, 4, 5), (8.0, 5.5)),
        GroupEvent("cross", 55, 75, None, (-1, 1), (-1, 1), (1, 2, 3, 4, 5, 6), (8.5, 6.0)),
        GroupEvent("split", SPLIT, SPLIT + 20, None, (1,), (1, 3), (1, 2, 3, 4, 5), (12.0, 5.5)),
        GroupEvent("leave", 111, 111, None, (-1,), (), (6,), (1.8, 4.6)),
    )
    return hand_made.truth(
        scenes(), events, name="meeting", px_per_m=60.0, vel=vel, box=boxes(look_at(), path[frame, person]),
        visibility=np.where((person == 2) & (frame < 30), 0.1, 1.0), labelled=np.arange(LENGTH) < LENGTH - 10,
        near=Near(np.array([20]), np.array([40]), np.array([6]), np.array([7])),
    )  # fmt: skip


@pytest.fixture
def sequence(truth: Truth) -> Sequence:
    def frames() -> Iterator[Frame]:
        rng = np.random.default_rng(3)
        for k in range(1, LENGTH + 1):
            now = truth.at(k)
            kept = rng.random(len(now.id)) < 0.9
            box = now.box[kept] + rng.normal(0, 2, (kept.sum(), 4))
            found = Detections(k, now.t, "image", box[:, :2] + box[:, 2:] / 2, box=box, score=np.ones(len(box)))
            yield Frame(k, now.t, detections=found)

    return Sequence(
        "meeting", FPS, LENGTH, frames, lambda: truth, image_size=(640, 480), camera=look_at(), scene=SCENE,
        has_detections=True,
    )  # fmt: skip


@pytest.fixture
def tracks(truth: Truth) -> list[Tracks]:
    """The truth, late by four frames and a little off, with a tracker's own ids; person 2 gets a new id half-way."""
    rng, answers, late, label = np.random.default_rng(1), [], 4, np.array([-1, 0, 7, 8])
    merge = GroupEvent("merge", MERGE, MERGE + late, MERGE + late, (0, 7), (0,), (0, 1, 2, 3, 4), (8.0, 5.4))
    split = GroupEvent("split", SPLIT, SPLIT + late, SPLIT + late, (0,), (0, 8), (0, 1, 2, 3, 4), (12.0, 5.4))
    for k in range(1, LENGTH + 1):
        now, before = truth.at(k), truth.at(max(k - late, 1))
        group_of = dict(zip(before.id.tolist(), before.group.tolist(), strict=True))
        ids = np.where((now.id == 2) & (k > 80), 20, now.id - 1)
        group = label[[max(group_of.get(i, -1), 0) for i in now.id.tolist()]]
        pos = now.pos + rng.normal(0, 0.05, now.pos.shape)
        n = len(ids)
        members = {g: (ids[group == g].tolist(), None) for g in np.unique(group[group >= 0]).tolist()}
        named = hand_made.Scene(dict(zip(ids.tolist(), pos.tolist(), strict=True)), members).groups()
        told = tuple(event for event in (merge, split) if event.emitted == k)
        cov, box = np.tile(np.eye(4), (n, 1, 1)), now.box + rng.normal(0, 2, (n, 4))
        answers.append(
            Tracks(k, now.t, "ground", "person", ids, group, pos, now.vel, cov, box, np.ones(n), named, told)
        )
    return answers
