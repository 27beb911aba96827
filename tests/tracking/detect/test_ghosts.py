"""Ghosts: what left becomes background at once, what came and stands never; at any frame rate, colour or grey."""

from __future__ import annotations

from copy import deepcopy
from functools import cache

import numpy as np
import pytest

from sim.types import Context
from tests import painted
from tests import reference_background as reference
from tests.painted import TALL
from tracking.detect import background_kernels, ghosts
from tracking.detect.background_settings import BackgroundSettings
from tracking.detect.foreground import Foreground

SCALE, PERSON, OTHER = TALL / 1.7, (160.0, 180.0, TALL), (240.0, 200.0, TALL)
LOOKS = ["colour", "grey"]


@cache
def picture(people, seed, look="colour"):
    image = painted.picture(people, np.random.default_rng(seed))
    image = image if look == "colour" else np.repeat(image[..., 1:2], 3, -1)
    image.setflags(write=False)
    return image


def trained(sample, fps=10.0, **settings):
    """The pipeline that has seen these people in its sample: (people, look) of each picture."""
    pictures = np.stack([picture(tuple(people), seed, look) for seed, (people, look) in enumerate(sample)])
    context = Context(fps, SCALE, image_size=(painted.WIDE, painted.HIGH), background=pictures)
    return Foreground(context, BackgroundSettings(**settings))


def made(people, look="colour", fps=10.0, **settings):
    return trained([(people, look)] * 12, fps, **settings)


def watch(pipeline, people, seconds, look="colour", protected=None):
    """Shows the people for some seconds; returns the blobs of the next picture."""
    keep = np.zeros(pipeline.shape, bool) if protected is None else protected
    for k in range(round(seconds * pipeline.model.fps)):
        pipeline.adapt(pipeline.segment(picture(tuple(people), 100 + k % 20, look)), keep)
    return pipeline.person_blobs(pipeline.segment(picture(tuple(people), 99, look)).mask)


@pytest.mark.parametrize("look", LOOKS)
@pytest.mark.parametrize("fps", [2.5, 7.0, 30.0])
def test_who_stood_in_the_whole_sample_leaves_no_ghost(fps, look):
    assert len(watch(made([PERSON], look, fps, background="trained"), [], 3.0, look)) == 1
    pipeline = made([PERSON], look, fps)
    assert len(watch(pipeline, [], 0.5, look)) == 1
    assert not len(watch(pipeline, [], 2.5, look))
    ground, body = painted.ground(), painted.shape(PERSON)
    expected = ground if look == "colour" else np.repeat(ground[..., 1:2], 3, -1)
    learned = np.moveaxis(pipeline.model.mean, 0, -1)
    assert (np.abs(learned - expected)[body].max(-1) < 10).mean() > 0.9
    assert len(pipeline.person_blobs(pipeline.segment(picture((PERSON,), 7, look)).mask)) == 1


@pytest.mark.parametrize("look", LOOKS)
@pytest.mark.parametrize("stay", [0.2, 0.4, 0.6, 0.8])
def test_who_stood_through_a_part_of_the_sample_is_no_background(stay, look):
    """However long they stayed, if the others of the sample show the ground."""
    pair = [PERSON, (184.0, 181.0, TALL)]
    sample = [(pair if k < 20 * stay else [], look) for k in range(20)]
    found = learned_ground(trained(sample), look)[painted.shape(PERSON)]
    assert (found < 10).mean() > 0.95
    if stay > 0.5:
        kept = learned_ground(trained(sample, background="trained"), look)[painted.shape(PERSON)]
        assert (kept < 10).mean() < 0.2


def learned_ground(pipeline, look):
    """How far the model is from the ground, (H, W) grey levels."""
    ground = painted.ground() if look == "colour" else np.repeat(painted.ground()[..., 1:2], 3, -1)
    return np.abs(np.moveaxis(pipeline.model.mean, 0, -1) - ground).max(-1)


def test_surroundings_are_filled_in_and_known_pixels_stay():
    planes = np.random.default_rng(0).uniform(90, 110, (3, 40, 50)).astype(np.float32)
    known = ~painted.inside(25, 20, 12, 15)[:40, :50]
    planes[:, ~known] = 250
    filled = ghosts.filled(planes, known)
    assert np.array_equal(filled[:, known], planes[:, known])
    assert 90 < filled[:, ~known].min() < filled[:, ~known].max() < 110


def test_without_surroundings_nothing_is_decided():
    first, second = (np.full((3, 20, 20), grey, np.float32) for grey in (100, 50))
    second[:, :9] = np.nan
    assert not ghosts.uncovered_in_sample(first, second, 20.0).any()


@pytest.mark.parametrize("look", LOOKS)
@pytest.mark.parametrize("fps", [2.5, 7.0, 30.0])
def test_who_comes_and_stands_is_not_absorbed(fps, look):
    pipeline = made([], look, fps)
    never = deepcopy(pipeline)
    never.ghosts = None
    for each in (pipeline, never):
        assert len(watch(each, [PERSON], 6.0, look)) == 1
    assert np.array_equal(pipeline.model.mean, never.model.mean)


def test_a_queue_that_stands_for_a_minute_beside_a_ghost_is_kept():
    """The ghost goes though a track protects it: it has a confirmed one, as it never moves."""
    queue = [(200.0 + 26 * k, 180.0 + k, TALL) for k in range(4)]
    pipeline = made([PERSON], fps=2.5)
    found = watch(pipeline, queue, 60.0, protected=np.ones(pipeline.shape, bool))
    people = np.any([painted.shape(person) for person in queue], axis=0)
    assert (found.label[people] > 0).mean() > 0.95
    assert not found.label[painted.shape(PERSON) & ~people].any()


def test_the_kernel_equals_its_twin():
    r = np.random.default_rng(0)
    gain, reach = np.array([1.1, 0.9, 1.0], np.float32), np.array([7.37, 8.37, 9.37], np.float32)
    colour, sightings = np.zeros((3, 12, 15), np.float32), np.zeros((12, 15), np.float32)
    twin = colour.astype(float), sightings.astype(float)
    still = r.integers(30, 200, (12, 15, 3))
    for k in range(40):
        noise = r.integers(-5, 6, still.shape) + 60 * (r.random((12, 15, 1)) < 0.03)
        image = (still + noise).astype(np.uint8)
        image.setflags(write=False)
        background_kernels.watch(tuple(np.moveaxis(image, -1, 0).copy()), gain, reach, colour, sightings)
        twin = reference.watch(image, gain, reach, *twin)
        np.testing.assert_allclose(colour, twin[0], rtol=1e-4, err_msg=str(k))
        assert np.array_equal(sightings, twin[1])
    assert sightings.max() > background_kernels.MEMORY


@pytest.mark.parametrize(("fps", "looks"), [(0.5, 3), (1.0, 3), (2.0, 3), (4.0, 5)])
def test_looks_before_something_is_a_ghost(fps, looks):
    """A second and a look, but no fewer than three looks, however slow the camera."""
    ground, region = np.full((3, 40, 40), 90, np.float32), np.zeros((40, 40), bool)
    region[10:30, 15:25] = True
    model = np.where(region, 160, ground).astype(np.float32)
    watched, image = ghosts.Ghosts((40, 40), np.ones(3), fps), np.moveaxis(ground, 0, -1).astype(np.uint8)
    found = [watched.find(image, np.ones(3, np.float32), region, model, 20.0, 50.0) for _ in range(looks)]
    assert [one is not None for one in found] == [False] * (looks - 1) + [True]
    assert found[-1][region].all()
