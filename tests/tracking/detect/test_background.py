"""Background subtraction: closed forms, people and light in the sample, lamps, removed objects, symmetries, twins."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.errors import InputError
from tests import reference_background as reference
from tracking.detect import background
from tracking.detect.background import (
    BACKGROUND,
    DARK,
    FOREGROUND,
    HIGHLIGHT,
    INTERLEAVE,
    SHADOW,
    Background,
    fused_foreground,
)
from tracking.detect.background_settings import BackgroundSettings
from tracking.detect.background_training import train
from tracking.detect.background_training_kernels import FLOOR

SIGMA = np.array([3.0, 2.0, 4.0])
FPS = 10.0


def scene(high=40, wide=50, seed=0, low=60, top=160):
    return np.random.default_rng(seed).uniform(low, top, (high, wide, 3))


def read_only(pictures):
    """The same, as frames and samples are: kernels are compiled anew for what can be written."""
    pictures.setflags(write=False)
    return pictures


def shot(colours, rng, sigma=SIGMA, gain=1.0):
    noisy = colours * gain + rng.normal(size=colours.shape) * sigma
    return read_only(np.clip(np.round(noisy), 0, 255).astype(np.uint8))


def shots(colours, number=50, seed=1, **how):
    rng = np.random.default_rng(seed)
    return read_only(np.stack([shot(colours, rng, **how) for _ in range(number)]))


def model(colours=None, seed=1, **settings):
    return Background(shots(scene() if colours is None else colours, seed=seed), FPS, BackgroundSettings(**settings))


def share(classes, kind):
    return float(np.mean(classes == kind))


# --- closed forms -----------------------------------------------------------------------------------------------------


def test_new_frames_of_the_empty_scene_are_background_at_about_the_detection_rate():
    mean = scene(80, 80)
    made = Background(shots(mean, 200), FPS, BackgroundSettings(detection_rate=0.99))
    rng = np.random.default_rng(5)
    kinds = np.concatenate([made.classify(shot(mean, rng)).ravel() for _ in range(10)])
    for kind in (FOREGROUND, SHADOW, HIGHLIGHT):
        assert 0.008 < share(kinds, kind) < 0.014


@pytest.mark.parametrize("channel", range(3))
def test_a_pixel_with_one_channel_that_never_keeps_its_level_has_no_background(channel):
    sample = shots(scene(20, 20), 30).copy()
    sample[:, 5:9, 5:9, channel] = np.linspace(0, 250, 30)[:, None, None]
    made = train(read_only(sample), 0.999, False)
    assert not made.valid[5:9, 5:9].any()
    assert made.valid.sum() == 400 - 16


# --- the five classes -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("background", ["adaptive", "trained"])
def test_five_classes_of_known_colours(background, monkeypatch):
    monkeypatch.setattr(Background, "_estimate_gain", lambda self, *_: self.gain)
    mean = np.broadcast_to(np.array([90.0, 100.0, 110.0]), (30, 50, 3))
    made = model(mean, background=background)
    scales = np.repeat([1.0, 0.6, 0.2, 1.1, 2.3], 10)
    picture = mean * scales[None, :, None]
    picture[20:] = mean[20:] * (1.6, 0.9, 0.3)
    classes = made.classify(np.round(picture).astype(np.uint8))
    brightest = FOREGROUND if background == "adaptive" else HIGHLIGHT
    for band, kind in enumerate((BACKGROUND, SHADOW, DARK, HIGHLIGHT, brightest)):
        assert np.all(classes[:20, 10 * band : 10 * band + 10] == kind), band
    assert np.all(classes[20:] == FOREGROUND)
    bands = 2 if background == "adaptive" else 1
    assert share(fused_foreground(classes), True) == pytest.approx((20 * 10 * bands + 10 * 50) / 1500)


# --- a sample with people, light and change ---------------------------------------------------------------------------


def test_people_in_the_sample_leave_no_trace():
    mean, rng = scene(), np.random.default_rng(2)
    sample = shots(mean).copy()
    for k, frame in enumerate(sample):
        if k % 5 < 2:
            frame[10:30, 10:30] = rng.integers(0, 255, 3)
    with_people, without = train(read_only(sample), 0.999, False), train(shots(mean), 0.999, False)
    there = np.s_[10:30, 10:30]
    assert with_people.valid.all()
    assert np.abs(with_people.mean - mean)[there].mean() < 1.3 * np.abs(without.mean - mean)[there].mean() + 0.2
    assert with_people.sigma[there].mean() == pytest.approx(without.sigma[there].mean(), rel=0.1)
    np.testing.assert_allclose(with_people.thresholds, without.thresholds, rtol=0.05)


@pytest.mark.parametrize("gain", [0.7, 1.3, (0.75, 1.0, 1.25)])
def test_a_sudden_change_of_light_does_not_flood_the_frame(gain):
    mean, rng = scene(), np.random.default_rng(7)
    picture = shot(mean, rng, gain=np.array(gain)).copy()
    picture[5:20, 5:15] = (20, 200, 20)
    classes = model(mean, detection_rate=0.9999).classify(picture)
    hole = np.ones(classes.shape, bool)
    hole[5:20, 5:15] = False
    assert share(fused_foreground(classes)[~hole], True) > 0.95
    assert share(classes[hole], BACKGROUND) > 0.99
    blind = model(mean, background="trained").classify(picture)
    assert share(blind[hole], BACKGROUND) < 0.5


# --- adaptation -------------------------------------------------------------------------------------------------------


PLAIN = np.broadcast_to(np.array([110.0, 120.0, 100.0]), (24, 24, 3))


def with_object(colour=(40, 200, 40)):
    """The plain scene with something of this colour in its middle."""
    picture = PLAIN.copy()
    picture[8:16, 8:16] = colour
    return picture


def foreground_over_time(made, picture, seconds, protected=None, seed=8):
    rng, curve = np.random.default_rng(seed), []
    for _ in range(int(seconds * FPS)):
        frame = shot(picture, rng)
        classes = made.classify(frame)
        curve.append(fused_foreground(classes)[8:16, 8:16].mean())
        made.adapt(frame, classes, protected)
    return np.array(curve)


@pytest.mark.parametrize("colour", [(40, 200, 40), (10, 10, 10)], ids=["put down", "dark"])
def test_what_stays_becomes_background_and_what_goes_leaves_no_ghost(colour):
    """Foreground adapts in 10 s: a difference of D is gone after 10 ln(D / threshold) seconds, and so is its ghost."""
    made = model(PLAIN, background_time=1)
    on = foreground_over_time(made, with_object(colour), 60)
    assert on[:10].min() > 0.95
    assert on[-50:].max() < 0.1
    off = foreground_over_time(made, PLAIN, 60, seed=9)
    assert off[:10].min() > 0.95
    assert off[-50:].max() < 0.1


def test_a_model_that_stays_as_trained_keeps_foreground_for_ever():
    made = model(PLAIN, background="trained")
    assert foreground_over_time(made, with_object(), 60)[-50:].min() > 0.95


def test_a_protected_place_learns_nothing():
    keep = np.zeros((24, 24), bool)
    keep[8:16, 8:16] = True
    made = model(PLAIN, background_time=1)
    before = made.mean[:, 8:16, 8:16].copy()
    assert foreground_over_time(made, with_object(), 30, keep).min() > 0.95
    assert np.array_equal(made.mean[:, 8:16, 8:16], before)


def test_light_that_drifts_by_a_third_either_way_is_followed():
    mean, rng, worst = scene(), np.random.default_rng(10), 0.0
    made = model(mean)
    for t in range(300):
        frame = shot(mean, rng, gain=1 + 0.3 * np.sin(t / 30))
        classes = made.classify(frame)
        made.adapt(frame, classes)
        worst = max(worst, float(np.mean(classes != BACKGROUND)))
    assert worst < 0.02


# --- symmetries and twins ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("follow", [True, False])
def test_training_equals_its_twin(follow):
    rng = np.random.default_rng(14)
    sample = shots(scene(), 30).copy()
    sample[::3, 5:20, 5:20] = rng.integers(0, 255, 3)
    sample[:, :4, :4] = rng.integers(0, 255, (30, 4, 4, 3))
    made = train(read_only(sample), 0.999, follow)
    from tracking.detect.background_training import frame_gains

    gains = frame_gains(sample) if follow else np.ones((30, 3))
    values = (sample / gains[:, None, None, :]).astype(np.float32).astype(float)
    mean, sigma, inlier, valid, second = reference.spread(values)
    s, b = reference.normalisers(values, mean, sigma, inlier)
    np.testing.assert_allclose(made.mean, mean, rtol=1e-5)
    np.testing.assert_allclose(made.sigma, sigma, rtol=1e-4)
    np.testing.assert_allclose(made.s, s, rtol=1e-4)
    np.testing.assert_allclose(made.b, b, rtol=1e-4)
    np.testing.assert_allclose(made.second, second, rtol=1e-5)
    assert 0.05 < np.isnan(second).mean() < 0.95
    assert np.array_equal(made.valid, valid)
    assert not valid.all()


def test_kernels_equal_their_twins():
    made = model(scene(), dark=0.7)
    rng = np.random.default_rng(15)
    for _ in range(6):
        picture = shot(scene() * rng.uniform(0.4, 1.8, (40, 50, 1)), rng).copy()
        picture[:6] = rng.integers(0, 255, (6, 50, 3))
        classes = made.classify(read_only(picture))
        planes = np.moveaxis(made.mean, 0, -1).astype(float), np.moveaxis(made.var, 0, -1).astype(float)
        limits = (*made.thresholds, 0.7, background.BRIGHT)
        twin = reference.classify(picture, planes[0], np.sqrt(planes[1]), made.s, made.b, made.valid, made.gain, limits)
        assert np.bincount(classes.ravel(), minlength=5).min() > 20
        assert np.mean(classes != twin) < 1e-3
        keep, rows = rng.random((40, 50)) < 0.3, np.arange(40) % INTERLEAVE == made._first_row
        fast, slow = (1 - np.exp(-INTERLEAVE / (FPS * t)) for t in (20.0, 200.0))
        twins = reference.adapt(picture, classes, keep, *planes, made.gain.astype(float), rows, fast, slow)
        made.adapt(picture, classes, keep)
        for kernel, twin in zip((made.mean, made.var), twins, strict=True):
            np.testing.assert_allclose(np.moveaxis(kernel, 0, -1), twin, rtol=1e-4)


def test_a_still_picture_can_be_trained_on():
    still = read_only(np.repeat(scene()[None].astype(np.uint8), 12, axis=0))
    made = Background(still, FPS)
    assert np.isfinite(made.mean).all()
    assert made.var.min() >= FLOOR**2
    assert share(made.classify(still[0]), BACKGROUND) == 1
    assert share(made.classify(still[0] + np.uint8(1)), BACKGROUND) == 1
    dark = still[0].copy()
    dark[:15] //= 8
    assert share(fused_foreground(made.classify(dark)[:15]), True) > 0.95


# --- bad input --------------------------------------------------------------------------------------------------------


NO_SAMPLES = [
    (np.zeros((50, 8, 8), np.uint8), "uint8, BGR"),
    (np.zeros((50, 8, 8, 3)), "uint8, BGR"),
    (np.zeros((50, 0, 8, 3), np.uint8), "uint8, BGR"),
    (np.zeros((9, 8, 8, 3), np.uint8), "at least 10 frames"),
    (read_only(np.random.default_rng(0).integers(0, 255, (50, 8, 8, 3), np.uint8)), "no background can be learned"),
]


@pytest.mark.parametrize(("sample", "words"), NO_SAMPLES, ids=["grey", "floats", "empty", "few", "all pixels change"])
def test_a_sample_that_is_none_is_refused_in_one_line(sample, words):
    with pytest.raises(InputError, match=words):
        Background(sample, FPS)


# --- grey and extreme pictures ---------------------------------------------------------------------------------------


def test_a_frame_of_another_kind_is_refused():
    made = Background(shots(scene()), FPS)
    for wrong in (np.zeros((20, 20, 3), np.uint8), np.zeros((40, 50), np.uint8), np.zeros((40, 50, 3))):
        for use in (made.classify, lambda picture: made.adapt(picture, np.zeros((40, 50), np.uint8))):
            with pytest.raises(InputError, match="as the background sample"):
                use(wrong)
