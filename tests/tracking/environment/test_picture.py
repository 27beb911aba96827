"""Pictures of the environment: a plan or the frame itself, with what is tracked, before the first frame and after."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.drawing.canvas import FLOOR, colour
from tracking.environment.env import TuningEnv

SHORT = ["camera.fps=5", "duration=4"]


def env(suite="cross", tracker="blob", **options):
    made = {"set": SHORT, "decision_every": 5, "render_mode": "rgb_array", **options}
    return TuningEnv(tracker, suite, **made)


def stepped(made, steps=3):
    made.reset(seed=1)
    pictures = [made.render()]
    for _ in range(steps):
        made.step(np.zeros(made.action_space.shape, np.float32))
        pictures.append(made.render())
    return pictures


def of_colour(picture, ink):
    """How many px are of this BGR colour."""
    return int((picture == np.array(ink[::-1])).all(axis=2).sum())


@pytest.mark.parametrize("tracker", ["blob", "group-pda"])
def test_a_plan_with_what_is_tracked(tracker):
    made = env(tracker=tracker)
    pictures = stepped(made)
    assert all(p.shape == (512, 640, 3) and p.dtype == np.uint8 and p.flags.c_contiguous for p in pictures)
    assert of_colour(pictures[0], FLOOR) > 0.5 * 512 * 640
    assert not np.array_equal(pictures[1][32:], pictures[2][32:])
    ids = made.rollout.tracks[-1].id.tolist()
    assert ids
    assert all(of_colour(pictures[-1], colour(k)) > of_colour(pictures[0], colour(k)) for k in ids)


def test_places_are_where_they_belong():
    """Everybody's ring stands round his place: x to the right, y upwards."""
    made = env()
    picture = stepped(made, 4)[-1]
    answer, size = made.rollout.tracks[-1], made.rollout.sequence.scene.size
    scale = min(640 / size[0], 480 / size[1])
    for id, (x, y) in zip(answer.id.tolist(), answer.pos.tolist(), strict=True):
        u = 320 + (x - size[0] / 2) * scale
        v = 32 + 240 - (y - size[1] / 2) * scale
        around = picture[max(int(v) - 12, 0) : int(v) + 12, max(int(u) - 12, 0) : int(u) + 12]
        assert of_colour(around, colour(id)) > 5


def test_without_a_render_mode_there_is_no_picture():
    made = env(render_mode=None)
    made.reset(seed=1)
    assert made.render() is None
