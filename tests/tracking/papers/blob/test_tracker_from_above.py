"""`blob` from pictures taken from straight above: small people, turned any way, close together, half unseen."""

from __future__ import annotations

import numpy as np
import pytest

from sim.scene.camera import camera_rotation
from sim.types import Camera, Context, Frame
from tests import painted
from tests.painted import ids, overlap
from tracking.papers.blob.tracker import Blob

HIGH, WIDE, FPS = 120, 160, 10.0
COLOURS = (30, 20, 190), (190, 30, 20), (20, 170, 40)


def camera(scale):
    return Camera(
        "top", (WIDE, HIGH), (scale, scale), (WIDE / 2, HIGH / 2), np.array([0.0, 0, 10]),
        camera_rotation(np.pi / 2, 0.0), px_per_m=scale,
    )  # fmt: skip


def box(scale, x, y, heading):
    """ltwh of somebody of 1.7 m."""
    a, b = 0.27 * 0.85 * scale, 0.16 * 0.85 * scale
    half = np.hypot([a * np.sin(heading), a * np.cos(heading)], [b * np.cos(heading), b * np.sin(heading)])
    return np.concatenate([np.array([x, y]) - half, 2 * half])


def picture(r, scale, people, *, shade=None):
    """People (x, y, heading) as turned ellipses; shade: whose half behind the shoulders is darkened ground."""
    v, u = np.mgrid[:HIGH, :WIDE] + 0.5
    image = painted.ground()[:HIGH, :WIDE].copy()
    for k, (x, y, heading) in enumerate(people):
        along = (u - x) * np.cos(heading) + (v - y) * np.sin(heading)
        across = (v - y) * np.cos(heading) - (u - x) * np.sin(heading)
        body = (across / (0.27 * 0.85 * scale)) ** 2 + (along / (0.16 * 0.85 * scale)) ** 2 <= 1
        dark = body & (across < -0.05 * scale) if k == shade else np.zeros_like(body)
        image[body & ~dark] = COLOURS[k % 3]
        image[dark] *= 0.6
    return np.clip(image + 2 * r.standard_normal(image.shape), 0, 255).astype(np.uint8)


def track(scale, frames, **kind):
    r = np.random.default_rng(0)
    tracker, seen = Blob(), camera(scale)
    sample = np.stack([picture(r, scale, []) for _ in range(20)])
    tracker.reset(Context(FPS, scale, camera=seen, image_size=(WIDE, HIGH), background=sample), 0)
    return [tracker.step(Frame(k + 1, k / FPS, image=picture(r, scale, p, **kind)), None) for k, p in enumerate(frames)]


@pytest.mark.parametrize("scale", [20.0, 40.0])
@pytest.mark.parametrize("heading", [0.0, 0.8, 1.6])
def test_one_person_is_one_track(scale, heading):
    way = [(30 + 0.1 * k * scale, 30 + 0.05 * k * scale, heading) for k in range(20)]
    made = track(scale, [[p] for p in way])
    assert [len(t.id) for t in made[2:]] == [1] * 18
    assert len(ids(made)) == 1
    assert np.mean([overlap(t.box[0], box(scale, *p)) for t, p in zip(made[5:], way[5:], strict=True)]) > 0.6


@pytest.mark.parametrize("turn", [0.0, 1.6])
def test_two_who_touch_are_two(turn):
    """Side by side or one behind the other as the picture has it."""
    step = 0.42 * np.array([np.sin(turn), np.cos(turn)]) * 40
    pair = [[(40 + 3 * k, 50, turn), (40 + 3 * k + step[0], 50 + step[1], turn)] for k in range(25)]
    made = track(40.0, pair)
    assert [len(t.id) for t in made[3:]] == [2] * 22
    assert len(ids(made)) == 2


def test_who_turns_on_the_spot_stays_the_same():
    made = track(40.0, [[(60, 60, 0.0 if k < 12 else 1.57)] for k in range(24)])
    assert len(ids(made)) == 1
    assert all(len(t.id) == 1 for t in made[2:])
