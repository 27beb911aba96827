"""Who is behind a known pillar or wall, and what the trackers make of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sim.types import Camera, Context, Detections, Frame, Scene
from tracking.papers.relational.occluders import covered_by_people, hidden_share
from tracking.papers.relational.particle_set import ParticleSet
from tracking.papers.relational.tracker import Particle

CAMERA = Camera("pinhole", (640, 480), (500.0, 500.0), (320.0, 240.0), np.array([0.0, -10.0, 3.0]), np.eye(3))
PILLAR = Scene(np.array([20.0, 20.0]), pillars=np.array([[0.0, 0.0, 0.3]]))
WALL = Scene(np.array([20.0, 20.0]), walls=np.array([[[-1.0, 0.0], [1.0, 0.0]]]))


@pytest.mark.parametrize("scene", [PILLAR, WALL])
def test_behind_beside_and_in_front(scene):
    pos = np.array([[[0.0, 2.0], [1.5, 2.0], [0.0, -1.0], [0.0, 40.0]]])
    found = hidden_share(pos, np.ones((1, 4)), CAMERA, scene)
    assert found.tolist() == [1.0, 0.0, 0.0, float(scene.pillar_height > 3.0 - 2.15 * 0.2)]


@pytest.mark.parametrize(("camera", "scene"), [(None, PILLAR), (CAMERA, None), (CAMERA, Scene(np.ones(2)))])
def test_without_knowledge_nobody_is_hidden(camera, scene):
    assert hidden_share(np.array([[[0.0, 2.0]]]), np.ones((1, 1)), camera, scene).tolist() == [0.0]


@pytest.mark.parametrize(("scene", "kept"), [(PILLAR, True), (None, False)])
def test_a_person_behind_a_pillar_is_kept(scene, kept):
    """A person who waits behind a pillar for 4 s, longer than the time window, is still tracked if it is known."""
    tracker = Particle()
    tracker.reset(Context(10.0, float("nan"), CAMERA, scene), 0)
    places = [(-1.0 + 0.1 * k, 2.0) for k in range(10)] + [None] * 40
    for k, place in enumerate(places, 1):
        pos = np.zeros((0, 2)) if place is None else np.array([place])
        if place is None:  # stand still: the test is of the belief, not of the motion
            tracker.particles.vel[:] = 0.0
            tracker.particles.pos[:] = [0.0, 2.0]
        found = Detections(k, 0.1 * k, "ground", pos, None, None, np.ones(len(pos)))
        tracks = tracker.step(Frame(k, 0.1 * k), found)
    assert (len(tracks.id) == 1) == kept


def people(*places):
    made = ParticleSet.empty(10)
    for place in places:
        made.add(np.tile(place, (10, 1))[:, None], np.zeros((10, 1, 2)), 1.0)
    return made


def test_people_hide_each_other():
    """The line of sight over the head of one at 18 m from a camera at 3 m meets another, at 24 m, at 1.27 m."""
    hidden, cut = covered_by_people(people([0, 0], [0, 0.6], [0.25, 8], [0.1, 14], [3, 3]), CAMERA, 0.25)
    np.testing.assert_allclose(hidden, [0, 1, 0, 0, 0], rtol=1e-12)
    np.testing.assert_allclose(cut, [0, 1, 0.722, 0.912, 0], atol=0.01)


@pytest.mark.parametrize(("camera", "radius"), [(None, 0.25), (CAMERA, 0.0)])
def test_without_camera_or_bodies_people_hide_nobody(camera, radius):
    hidden, cut = covered_by_people(people([0, 0], [0, 0.6]), camera, radius)
    assert not hidden.any()
    assert not cut.any()


@pytest.mark.parametrize(("visible", "is_hidden"), [(0.16, 1.0), (0.24, 0.0)])
def test_hidden_is_who_shows_less_than_a_fifth(visible, is_hidden):
    """The camera is as high as heads are, so that the other one covers the whole height of a part of the width."""
    at_heads = replace(CAMERA, position=np.array([0.0, -10.0, 1.7]))
    hidden, _ = covered_by_people(people([0, 0], [2 * 0.25 * visible, 0.001]), at_heads, 0.25)
    np.testing.assert_allclose(hidden, [0.0, is_hidden], atol=1e-12)
