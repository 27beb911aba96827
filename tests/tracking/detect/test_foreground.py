"""The pipeline of all trackers from pixels: plausible frames, protected places, scale, person blobs."""

from __future__ import annotations

from copy import deepcopy
from functools import cache

import numpy as np
import pytest

from sim.types import Context
from tests import painted
from tests.painted import TALL
from tracking.detect import blobs
from tracking.detect.background import Background, fused_foreground
from tracking.detect.background_settings import BackgroundSettings
from tracking.detect.foreground import ASSUMED_HEIGHT, Foreground
from tracking.detect.person_size import PersonSize

SCALE, PERSON = TALL / 1.7, (160.0, 180.0, TALL)


@cache
def context(scale=SCALE, people=()):
    sample = painted.sample(np.random.default_rng(0), 14, people)
    return Context(painted.FPS, scale, image_size=(painted.WIDE, painted.HIGH), background=sample)


@cache
def trained(scale, **settings):
    return Foreground(context(scale), BackgroundSettings(**settings))


def made(scale=SCALE, **settings):
    return deepcopy(trained(scale, **settings))


def picture(*people, seed=1):
    return painted.picture(people, np.random.default_rng(seed))


def test_a_segmented_picture_is_the_cleaned_foreground_of_the_models_classes():
    pipeline = made()
    seen = pipeline.segment(picture(PERSON))
    alone = Background(context().background, painted.FPS, BackgroundSettings())
    classes = alone.classify(picture(PERSON))
    assert np.array_equal(seen.classes, classes)
    assert np.array_equal(seen.mask, blobs.clean(fused_foreground(classes), SCALE))
    assert seen.plausible
    assert seen.mask[int(180 - TALL / 2), 160]


def test_a_person_is_one_blob_and_settings_are_followed():
    pipeline = made(dark=0.4, background_time=7.0)
    found = pipeline.person_blobs(pipeline.segment(picture(PERSON)).mask)
    assert len(found) == 1
    assert found.ellipse[0, :2] == pytest.approx([160, 180 - TALL / 2], abs=4)
    pipeline.follow(BackgroundSettings(dark=0.2, background_time=9.0))
    assert pipeline.model.settings.background_time == 9.0


def test_a_picture_with_more_foreground_than_people_can_cover_is_implausible(monkeypatch):
    share = np.mean(made().segment(picture(PERSON)).mask)
    monkeypatch.setattr("tracking.detect.foreground.MOST_FOREGROUND", share)
    assert made().segment(picture(PERSON)).plausible
    monkeypatch.setattr("tracking.detect.foreground.MOST_FOREGROUND", share * 0.99)
    assert not made().segment(picture(PERSON)).plausible
    assert made(background="trained").segment(picture(PERSON)).plausible


@pytest.mark.parametrize("unknown", [np.nan, 0.0])
def test_an_unknown_scale_is_guessed_from_the_images_height(unknown):
    assert made(unknown).scale == painted.HIGH / ASSUMED_HEIGHT
    assert made(50.0).scale == 50.0


def test_the_sample_shows_how_large_people_are():
    shown = context(np.nan, tuple(painted.spread()))
    size = PersonSize(shown)
    Foreground(shown, BackgroundSettings()).learn_person_size(size, shown.background)
    assert size.px_per_m == pytest.approx(SCALE, rel=0.06)
