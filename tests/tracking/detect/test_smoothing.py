"""Smoothing of noisy pictures: the noise that is measured, and the window that follows from it."""

from __future__ import annotations

import numpy as np
import pytest

from sim.types import Context
from tests.painted import ground
from tracking.detect.background_settings import BackgroundSettings
from tracking.detect.foreground import Foreground
from tracking.detect.smoothing import independent_noise, smoothed, window


def sample(noise: float, frames: int = 20) -> np.ndarray:
    r = np.random.default_rng(5)
    return np.clip(np.rint(ground() + noise * r.normal(size=(frames, *ground().shape))), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("noise", [2.0, 8.0, 14.0])
def test_noise_is_measured_whoever_passes_and_however_light_changes(noise: float) -> None:
    made = sample(noise)
    people = np.random.default_rng(6).integers(50, 200, (20, 1, 1, 3))
    made[:, :, :80] = np.clip(people + (made[:, :, :80] - ground()[:, :80]), 0, 255)
    bright = np.clip(made * np.linspace(0.9, 1.1, 20)[:, None, None, None], 0, 255).astype(np.uint8)
    assert independent_noise(made) == pytest.approx(noise, rel=0.3)
    assert independent_noise(bright) == pytest.approx(noise, rel=0.35)


def test_one_frame_or_column_has_no_noise() -> None:
    assert independent_noise(sample(9.0, 1)) == 0
    assert independent_noise(sample(9.0)[:, :, :1]) == 0


def test_the_window_grows_with_the_noise() -> None:
    assert [window(noise) for noise in (0.0, 6.0, 6.1, 18.0, 18.1, 30.0, 30.1)] == [1, 1, 3, 3, 5, 5, 1]


def test_smoothing_is_a_mean_and_none_of_quiet_pictures() -> None:
    image = sample(3.0)[0]
    assert smoothed(image, 1) is image
    mean = image[9:12, 19:22].astype(float).mean((0, 1))
    np.testing.assert_array_equal(smoothed(image, 3)[10, 20], np.rint(mean))


@pytest.mark.parametrize(("noise", "side"), [(3.0, 1), (14.0, 3)])
def test_pictures_are_smoothed_as_the_sample_is(noise: float, side: int) -> None:
    made = sample(noise)
    foreground = Foreground(Context(10.0, 40.0, background=made), BackgroundSettings())
    assert foreground.window == side
    np.testing.assert_array_equal(foreground.segment(made[0]).image, smoothed(made[0], side))
    assert Foreground(Context(10.0, 40.0, background=made), BackgroundSettings(background="trained")).window == 1
