"""How dark shadows are, from a histogram of brightness and from pictures."""

from __future__ import annotations

import numpy as np
import pytest

from tests.painted import ground
from tracking.detect.background import DARK, SHADOW, Background
from tracking.detect.shadow_depth import BINS, darkest_shadow

ALPHA = (np.arange(BINS) + 0.5) / BINS


def mode(middle: float, width: float, height: float) -> np.ndarray:
    return np.rint(height * np.exp(-((ALPHA - middle) ** 2) / (2 * width**2))).astype(np.int64)


@pytest.mark.parametrize("shadow", [0.6, 0.7, 0.84])
@pytest.mark.parametrize("width", [0.015, 0.03])
def test_the_limit_is_below_the_mode_of_shadows_by_their_width(shadow: float, width: float) -> None:
    found = darkest_shadow(mode(shadow, width, 5000), 0.5)
    assert found is not None
    assert shadow - 2.2 * width - 0.03 <= found <= shadow - 1.5 * width + 0.01


def test_clothes_are_no_shadows_though_they_are_many() -> None:
    clothes = mode(0.55, 0.05, 3000) + mode(0.3, 0.1, 50_000)
    found = darkest_shadow(clothes + mode(0.84, 0.02, 5000), 0.5)
    assert found is not None
    assert 0.75 < found < 0.84


def test_rough_counts_do_not_end_the_mode() -> None:
    wide = np.where(np.arange(BINS) % 4 == 0, 0.8, 1.0) * mode(0.85, 0.05, 400)
    found = darkest_shadow(wide.astype(np.int64), 0.5)
    assert found is not None
    assert found < 0.78


def test_the_setting_is_the_least_limit_and_few_pixels_tell_nothing() -> None:
    assert darkest_shadow(mode(0.7, 0.02, 5000), 0.68) == 0.68
    assert darkest_shadow(mode(0.7, 0.02, 5), 0.5) is None
    assert darkest_shadow(np.zeros(BINS, np.int64), 1.0) is None


@pytest.mark.parametrize("grey", [True, False])
def test_light_clothes_are_foreground_where_shadows_are_lighter(grey: bool) -> None:
    """Shadows of 0.85 and clothes of 0.7 of the ground's brightness, in its colours."""
    r = np.random.default_rng(3)
    floor = ground() if not grey else np.repeat(ground()[..., :1], 3, -1)
    frames = []
    for k in range(30):
        light = np.ones(floor.shape[:2])
        light[60:110, 10 * k : 10 * k + 40] = 0.85
        noise = r.normal(0, 2, floor.shape[:2])[..., None] if grey else r.normal(0, 2, floor.shape)
        frames.append(np.clip(np.rint(floor * light[..., None] + noise), 0, 255).astype(np.uint8))
    made = Background(np.stack(frames), 10.0)
    light = np.ones(floor.shape[:2])
    light[60:110, 100:140], light[60:110, 200:240] = 0.85, 0.7
    classes = made.classify(np.rint(floor * light[..., None]).astype(np.uint8))
    assert (classes[65:105, 105:135] == SHADOW).mean() > 0.95
    assert (classes[65:105, 205:235] == DARK).mean() > 0.95
