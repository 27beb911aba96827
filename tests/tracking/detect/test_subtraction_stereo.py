"""Matching inside blobs: the disparities of the whole picture, at less cost; persons by their size."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from sim.scene.camera import project_pair
from tests.sim.scene.test_camera_stereo import rig
from tracking.detect import blobs
from tracking.detect.subtraction_stereo import LEAST_UNIQUE, MULTIPLE, SubtractionStereo, sampled
from tracking.papers.stereo.person_regions import LEAST_HEIGHT, person_mask, sizes

HIGH, WIDE = 120, 200


def pair(shift: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """A textured picture, and the same as seen from the right: moved to the left by `shift` px."""
    import cv2

    r = np.random.default_rng(seed)
    wide = cv2.GaussianBlur(r.uniform(0, 255, (HIGH, WIDE + 60)), (0, 0), 1.2)
    wide = 128 + 2.5 * (wide - wide.mean())
    x = np.arange(WIDE, dtype=np.float32)
    rows = np.repeat(np.arange(HIGH, dtype=np.float32)[:, None], WIDE, 1)

    def view(offset: float) -> np.ndarray:
        columns = np.repeat((x + 30 + offset)[None], HIGH, 0).astype(np.float32)
        return np.clip(cv2.remap(wide.astype(np.float32), columns, rows, cv2.INTER_CUBIC), 0, 255).astype(np.uint8)

    return view(0.0), view(shift)


def three_regions() -> np.ndarray:
    mask = np.zeros((HIGH, WIDE), bool)
    mask[20:60, 40:55] = mask[50:90, 100:112] = mask[30:70, 105:125] = True
    return mask


def found_in(mask: np.ndarray) -> blobs.Blobs:
    return blobs.find(mask, 1)


def whole_match(stereo: SubtractionStereo, left: np.ndarray, right: np.ndarray, most: int) -> np.ndarray:
    """Disparities of the whole picture; most: largest difference in the left-right check, -1 for no check."""
    matcher = cv2.StereoBM.create(stereo.disparities, stereo.block)
    matcher.setUniquenessRatio(LEAST_UNIQUE)
    matcher.setTextureThreshold(0)
    matcher.setDisp12MaxDiff(most)
    raw = matcher.compute(left, right)
    return np.where(raw > 0, raw.astype(np.float32) / MULTIPLE, np.float32(np.nan))


def same(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return (a == b) | (np.isnan(a) & np.isnan(b))


@pytest.mark.parametrize("shift", [3.0, 6.4, 11.7])
def test_it_finds_the_shift_to_a_part_of_a_pixel(shift: float) -> None:
    found = SubtractionStereo(14.0, 9).match(*pair(shift), found_in(three_regions()))
    assert np.isfinite(found[three_regions()]).mean() > 0.95
    assert np.isnan(found[~three_regions()]).all()
    assert np.nanmedian(np.abs(found - shift)) < 0.1


@pytest.mark.parametrize(("largest", "block"), [(14.0, 9), (14.0, 5), (40.0, 15), (14.0, 35)])
@pytest.mark.parametrize("high", [HIGH, HIGH - 1])
def test_inside_the_mask_it_is_bit_equal_to_a_match_of_the_whole_picture(largest: float, block: int, high: int) -> None:
    """But for the left-right check, which sees fewer pixels: it may keep what a check of the whole picture removes."""
    left, right = (image[:high] for image in pair(5.3))
    left[:, 150:] = 90  # without texture
    stereo = SubtractionStereo(largest, block)
    checked, unchecked = (whole_match(stereo, left, right, most) for most in (1, -1))
    specks = np.random.default_rng(0).uniform(size=left.shape) < 0.02
    corner = np.zeros(left.shape, bool)
    corner[-3:, -30:] = True
    for mask in (three_regions()[:high], specks, corner, np.ones(left.shape, bool)):
        found = stereo.match(left, right, found_in(mask))
        known = np.isfinite(found)
        assert np.array_equal(found[known], unchecked[known])
        assert not (known & ~mask).any()
        assert known[mask & np.isfinite(checked)].all()
        assert np.count_nonzero(known[mask] & np.isnan(checked[mask])) <= 0.02 * mask.sum()
    assert same(found, checked).all()  # of a mask that is the whole picture


def test_what_another_hides_from_the_right_camera_has_no_disparity() -> None:
    far, (left, right) = pair(3.0), pair(11.0, seed=1)
    left[:, :100] = far[0][:, :100]
    right[:, : 100 - 11] = far[1][:, : 100 - 11]  # the near part covers columns 92 to 100 of the far one
    mask = np.zeros(left.shape, bool)
    mask[20:100, 60:140] = True
    found = SubtractionStereo(14.0, 9).match(left, right, found_in(mask))
    assert np.nanmedian(found[20:100, 60:85]) == pytest.approx(3.0, abs=0.2)
    assert np.nanmedian(found[20:100, 110:140]) == pytest.approx(11.0, abs=0.2)
    assert np.isfinite(found[30:90, 93:96]).mean() < 0.2


@pytest.mark.parametrize("size", [(3, 200), (120, 20), (9, 24)])
def test_pictures_without_room_for_a_block_have_no_disparities(size: tuple[int, int]) -> None:
    left, right = (image[: size[0], : size[1]].copy() for image in pair(5.3))
    found = SubtractionStereo(14.0, 9).match(left, right, found_in(np.ones(size, bool)))
    assert np.isfinite(found).sum() <= (1 if size == (9, 24) else 0)


def test_the_disparity_at_a_point_is_the_median_of_what_is_known() -> None:
    d = np.full((10, 10), np.nan, np.float32)
    d[4, 4:7] = [2.0, 8.0, 3.0]
    assert sampled(d, np.array([[5.5, 4.5], [0.5, 0.5], [6.5, 5.5]]), 1).tolist() == pytest.approx(
        [3.0, np.nan, 5.5], nan_ok=True
    )
    assert sampled(d, np.zeros((0, 2)), 1).shape == (0,)


DEVIATIONS = 0.3, 0.3, 0.02


def region(camera, foot, width: float, height: float, noise: float = 0.02, mask=None, d=None):
    """Mask and disparities of an upright board facing the camera."""
    r = np.random.default_rng(0)
    mask = np.zeros((240, 320), bool) if mask is None else mask
    d = np.full((240, 320), np.nan, np.float32) if d is None else d
    s, t = np.meshgrid(np.linspace(-width / 2, width / 2, 90), np.linspace(0, height, 200))
    X = np.column_stack([foot[0] + s.ravel(), np.full(s.size, foot[1]), t.ravel()])
    uvd = project_pair(camera, X)
    u, v = np.floor(uvd[:, :2]).astype(int).T
    inside = (u >= 0) & (u < 320) & (v >= 0) & (v < 240)
    mask[v[inside], u[inside]] = True
    d[v[inside], u[inside]] = uvd[inside, 2] + noise * r.standard_normal(inside.sum())
    return mask, d


@pytest.mark.parametrize("tilt", [10.0, 40.0])
def test_height_and_width_are_those_of_the_body(tilt: float) -> None:
    camera = rig(tilt, height=4.0, baseline=0.5)
    for noise in (0.0, 0.4):
        mask, d = region(camera, (1.2, 6.0), 0.45, 1.7, noise=noise)
        height, width, error = sizes(blobs.find(mask, 4), d, camera, (0.0, 0.0, noise))
        assert np.sqrt(height[0] ** 2 - error[0] ** 2) == pytest.approx(1.7, abs=0.2)
        assert width[0] == pytest.approx(0.45, abs=0.1)


def test_persons_are_told_by_size_and_truncated_ones_are_kept() -> None:
    camera = rig(20.0, height=4.0, baseline=0.5)
    mask, d = region(camera, (0.0, 6.0), 0.45, 1.7)
    region(camera, (2.0, 6.0), 0.4, 0.3, mask=mask, d=d)  # a dog
    region(camera, (1.0, 9.0), 0.04, 1.7, mask=mask, d=d)  # a pole
    region(camera, (-1.8, 9.0), 0.8, 3.6, mask=mask, d=d)  # a bus stop
    found = blobs.find(mask, 4)
    assert len(found) == 4
    assert not found.cut().any()
    kept = person_mask(found, d, camera, DEVIATIONS)
    u, v = project_pair(camera, np.array([[0.0, 6.0, 1.0]]))[0, :2].astype(int)
    assert kept[v, u]
    assert len(blobs.find(kept, 4)) == 1
    low, d = region(camera, (1.0, 2.05), 0.45, 0.4)
    height, _, _ = sizes(blobs.find(low, 4), d, camera, DEVIATIONS)
    assert height[0] < LEAST_HEIGHT
    assert blobs.find(low, 4).cut().all()
    assert person_mask(blobs.find(low, 4), d, camera, DEVIATIONS).any()
