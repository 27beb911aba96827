"""Person size over the image: from a camera exactly, from lone blobs where they agree."""

from __future__ import annotations

import numpy as np
import pytest

from sim.scene.camera import camera_rotation, project
from sim.types import Camera, Context
from tracking.detect import typical_person
from tracking.detect.person_size import CLEANED_AWAY, ENOUGH, PersonSize

BARE = Context(10.0, float("nan"), image_size=(480, 360))


def camera(tilt):
    """Five metres up, looking down by `tilt` degrees."""
    return Camera(
        "pinhole", (480, 360), (400.0, 400.0), (240.0, 180.0), np.array([0.0, 0, 5]), camera_rotation(tilt, 0.0)
    )


def ellipses(box):
    """The ellipses inscribed in boxes."""
    right_angle = np.full(len(box), np.pi / 2)
    return np.column_stack([box[:, :2] + box[:, 2:] / 2, box[:, 3], box[:, 2], right_angle])


def blobs(r, n, level=15.0, slope=0.2, noise=0.04):
    """(n, 4) boxes of people who stand all over an image."""
    foot = np.column_stack([r.uniform(40, 440, n), r.uniform(100, 340, n)])
    h = (level + slope * foot[:, 1]) * (1 + noise * r.normal(size=n))
    return np.column_stack([foot[:, 0] - 0.2 * h, foot[:, 1] - h, 0.4 * h, h])


@pytest.mark.parametrize("tilt", [0.2, 0.5])
def test_a_camera_gives_the_projection_of_a_person(tilt):
    size = PersonSize(Context(10.0, 60.0, camera=camera(tilt), image_size=(480, 360)))
    assert size.reliable
    for x, y in ((-2.0, 12.0), (3.0, 20.0)):
        ends = np.array([[x, y, 0], [x, y, 1.7]])
        (u, v), (_, head) = project(camera(tilt), ends)[0]
        h, w = size.at(np.array([[u, v]]))[0]
        assert h == pytest.approx(v - head, rel=0.06)
        assert 0.15 < w / h < 0.4


@pytest.mark.parametrize("wide", [0.36, 0.42, 0.6])
def test_people_wider_or_narrower_than_the_typical_one_are_learned_with_a_camera(wide):
    """Widths in m: 0.6 is that of the boxes of PETS, 0.36 what the simulator draws."""
    r = np.random.default_rng(0)
    seen = camera(0.4)
    size = PersonSize(Context(10.0, 60.0, camera=seen, image_size=seen.image))
    foot = np.column_stack([r.uniform(60, 420, 60), r.uniform(200, 340, 60)])
    h, expected = size.at(foot).T
    right = wide / typical_person.WIDTH * expected
    w = right * (1 + 0.04 * r.normal(size=60))
    box = np.column_stack([foot[:, 0] - w / 2, foot[:, 1] - h, w, h])
    assert size.one_person(box, ellipses(box)).mean() > 0.9
    size.learn(box, ellipses(box), np.ones(60, bool))
    assert size.at(foot)[:, 1] == pytest.approx(right, rel=0.1)


@pytest.mark.parametrize(("seen", "learned"), [(0.75, 0.9), (0.94, 0.94), (1.06, 1.06), (1.3, 1.1)])
def test_with_a_camera_a_tenth_of_the_height_is_learned(seen, learned):
    r, camera_here = np.random.default_rng(0), camera(0.4)
    size = PersonSize(Context(10.0, 60.0, camera=camera_here, image_size=camera_here.image))
    foot = np.column_stack([r.uniform(60, 420, 60), r.uniform(200, 340, 60)])
    h, w = (side.copy() for side in size.at(foot).T)
    box = np.column_stack([foot[:, 0] - w / 2, foot[:, 1] - seen * h, w, seen * h])
    size.learn(box, ellipses(box), np.ones(60, bool))
    assert size.at(foot)[:, 0] == pytest.approx(learned * h, rel=0.03)


def test_what_cleaning_removes_at_the_head_is_added():
    box, size = blobs(np.random.default_rng(0), 60, level=20.0, slope=0.0, noise=0.0), PersonSize(BARE)
    size.learn(box, ellipses(box), np.ones(60, bool))
    assert size.at(np.array([[240.0, 180.0]]))[0, 0] == pytest.approx(20 + CLEANED_AWAY, abs=0.1)


@pytest.mark.parametrize(("level", "learned"), [(24.0, True), (10.0, False)])
def test_people_count_from_their_height_however_slim(level, learned):
    box, size = blobs(np.random.default_rng(0), 60, level=level, slope=0.0), PersonSize(BARE)
    size.learn(box, ellipses(box), np.ones(60, bool))
    assert size.reliable == learned


@pytest.mark.parametrize("seed", range(6))
def test_the_line_is_found_among_groups_and_pieces(seed):
    r = np.random.default_rng(seed)
    box = blobs(r, 120)
    box[:30, 3] *= r.uniform(1.2, 1.6, 30)
    box[30:60, 3] *= r.uniform(0.4, 0.85, 30)
    size = PersonSize(BARE)
    size.learn(box, ellipses(box), np.ones(120, bool))
    assert size.reliable
    foot = np.array([[240.0, 120.0], [240.0, 320.0]])
    assert size.at(foot)[:, 0] == pytest.approx(15 + 0.2 * foot[:, 1], rel=0.08)


def test_few_or_wild_blobs_are_not_relied_on():
    r = np.random.default_rng(0)
    few, size = blobs(r, ENOUGH - 1), PersonSize(BARE)
    size.learn(few, ellipses(few), np.ones(len(few), bool))
    assert not size.reliable
    wild = blobs(r, 80)
    wild[:, 3] = np.exp(r.uniform(np.log(13), np.log(250), 80))
    wild[:, 2] = wild[:, 3] * r.uniform(0.2, 0.6, 80)
    size = PersonSize(BARE)
    size.learn(wild, ellipses(wild), np.ones(80, bool))
    assert not size.reliable
    cut, size = blobs(r, 80), PersonSize(BARE)
    size.learn(cut, ellipses(cut), np.zeros(80, bool))
    assert not size.reliable
