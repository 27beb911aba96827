"""What moves in a picture though nobody does: plants in wind, clouds, the sensor's noise, lossy blocks."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import binary_dilation, map_coordinates

from scenarios.schema.pictures import Light, Picture
from sim.hashing import canonical_hash
from sim.render.camera_view import NODE_STEP
from sim.render.renderer import Renderer
from sim.render.weather import draw_illumination
from sim.rng import look_seed
from sim.types import BACKGROUNDS, Motion, Scene
from tests.reference_sense import above, crowd, pinhole, small

BARE = Scene(np.array([16.0, 10.0]))
DARK = Light(shadow=0.0)
CALM = Picture(noise=0.0, blur_px=0.0)


VIEWS = {"high": small(pinhole(), 0.5).replace(baseline=0.5), "above": small(above(), 0.5)}


def motion_in(people: int = 6) -> Motion:
    return crowd(3, people=people, frames=12, scene=BARE)


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("share", [0.0, 0.03, 0.2])
def test_plants_cover_the_share_that_is_wanted(view: str, share: float) -> None:
    found = [
        Renderer(
            motion_in(1).replace(seed=seed), VIEWS[view], DARK, Picture(foliage=share)
        ).left_view.empty_scene.plants.mean()
        for seed in range(3)
    ]
    assert found == pytest.approx([share] * 3, abs=0.01)


@pytest.mark.parametrize("view", VIEWS)
def test_only_plants_move_and_where_wind_takes_them(view: str) -> None:
    empty = motion_in(0)
    picture = CALM.model_copy(update={"foliage": 0.15, "sway_px": 2.0})
    made = Renderer(empty, VIEWS[view], DARK, picture)
    scene, share = made.left_view, made.left_view.empty_scene.plants.astype(float)
    still = Renderer(empty, VIEWS[view], DARK, picture.model_copy(update={"sway_px": 0.0}))
    height, width = share.shape
    row, column = np.mgrid[0:height, 0:width].astype(float)
    at = [(row + 0.5) / NODE_STEP, (column + 0.5) / NODE_STEP]
    for index in (1, 7):
        image = made.frame(index)
        assert np.array_equal(image[share == 0], still.frame(index)[share == 0])
        across, down = (map_coordinates(nodes, at, order=1) for nodes in scene.wind((index - 1) / 10).astype(float))
        there = [np.clip(row - share * down, 0, height - 1), np.clip(column - share * across, 0, width - 1)]
        for k in range(3):
            colour = map_coordinates(still.frame(1)[..., k].astype(float), there, order=1)
            assert np.abs(colour - image[..., k])[2:-2, 2:-2].max() < 1.6
    assert (made.frame(1) != made.frame(7))[share > 0.9].any(axis=1).mean() > 0.7
    assert (made.background(0) != made.background(30))[share > 0.9].any(axis=1).mean() > 0.7


def test_both_cameras_see_one_wind_and_the_same_plants() -> None:
    made = Renderer(motion_in(0), VIEWS["high"], DARK, Picture(foliage=0.2))
    left, right = made.left_view, made.right_view
    d = made.pixels(1, disparity=True).disparity
    v, u = np.nonzero(np.isfinite(d))
    x = np.round(u - d[v, u]).astype(int).clip(0)
    there = binary_dilation(right.empty_scene.plants > 0, iterations=2)[v, x]
    assert there[left.empty_scene.plants[v, u] > 0.9].mean() > 0.98
    a, b = left.wind(0.5)[0], right.wind(0.5)[0]
    rows = slice(len(a) // 2, None)
    assert np.corrcoef(a[rows, 4:].ravel(), b[rows, 4:].ravel())[0, 1] > 0.5
    assert not np.array_equal(a, b)


def test_what_moves_changes_no_truth_and_no_person() -> None:
    motion = motion_in(8)
    quiet = Renderer(motion, VIEWS["high"], DARK, CALM)
    restless = Renderer(motion, VIEWS["high"], DARK, CALM.model_copy(update={"foliage": 0.3}))
    a, b = (made.pixels(5, disparity=True) for made in (quiet, restless))
    assert canonical_hash(a) == canonical_hash(b)
    assert np.array_equal(quiet.frame(5)[a.ids > 0], restless.frame(5)[a.ids > 0])


@pytest.mark.parametrize("view", VIEWS)
def test_clouds_pass_over_the_ground(view: str) -> None:
    light = Light(shadow=0.0, cloud=0.15, cloud_size=5.0)
    made, clear = (Renderer(motion_in(0), VIEWS[view], one, CALM) for one in (light, DARK))
    place = np.moveaxis(made.left_view.geometry.place[:2], 0, -1).astype(float)
    plain = clear.frame(1).astype(float).sum(axis=2)
    clouds = draw_illumination(light, look_seed(made.motion.seed, made.motion.name)).clouds
    near = (np.abs(place - [8, 5]) < [8, 5]).all(axis=2)
    for index in (1, 12):
        flat = place[near]
        wanted = np.exp(clouds.sampled(flat, np.zeros(len(flat)))((index - 1) / 10))
        image = made.frame(index).astype(float)
        found, shown = image.sum(axis=2)[near] / plain[near], (image < 255).all(axis=2)[near]
        assert shown.mean() > 0.8
        assert np.abs(found - wanted)[shown].max() < 0.04
        assert wanted.std() > 0.03
    assert not np.array_equal(made.frame(1), made.frame(12))


@pytest.mark.parametrize("shot", [0.0, 0.5, 1.0])
def test_noise_grows_with_brightness_by_the_share_of_shot_noise(shot: float) -> None:
    motion, camera = motion_in(0), small(pinhole(60.0), 0.5)
    for gain in (0.4, 1.0):
        light = Light(shadow=0.0, switch=({"at": -100, "gain": gain},))  # type: ignore[arg-type]
        made = Renderer(motion, camera, light, Picture(noise=4.0, shot=shot, texture=0.0))
        level = Renderer(motion, camera, light, Picture(noise=0.0, texture=0.0)).background(0).astype(float)
        empty = np.stack([made.background(k) for k in range(BACKGROUNDS)]).astype(float)
        wanted = 16.0 * (1 - shot + shot * level.mean() / 128) + 1 / 12  # rounding's own
        assert empty.var(axis=0, ddof=1).mean() == pytest.approx(wanted, rel=0.04)


@pytest.mark.parametrize(("view", "samples"), [("high", 2), ("above", 3)])
def test_a_pixel_is_the_mean_of_its_samples(view: str, samples: int) -> None:
    """Against as many times more pixels, each with one ray, on ground without grass."""
    motion = crowd(3, people=0, frames=1, scene=Scene(np.array([2000.0, 2000.0])))
    camera, picture = VIEWS[view], Picture(texture=0.8)
    camera = camera.replace(position=camera.position + np.array([1000.0, 1000.0, 0.0]))
    made = Renderer(motion, camera, DARK, picture.model_copy(update={"samples": samples})).left_view.empty_scene
    fine = Renderer(motion, small(camera, samples), DARK, picture).left_view.empty_scene
    height, width = made.direct.shape
    mean = fine.colour.reshape(height, samples, width, samples, 3).mean(axis=(1, 3))
    assert np.abs(mean - made.colour).max() < 1e-3
