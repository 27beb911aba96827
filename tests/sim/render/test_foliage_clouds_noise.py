"""What moves in a picture though nobody does: plants in wind, clouds, the sensor's noise, lossy blocks."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import binary_dilation, map_coordinates

from scenarios.schema.scenario import Light, Picture
from sim.hashing import canonical_hash
from sim.render.camera_view import NODE_STEP
from sim.render.renderer import make_renderer
from sim.render.weather import draw_illumination, moving_pattern, oscillation
from sim.types import BACKGROUNDS, Camera, Motion, Scene
from tests.reference_sense import above, crowd, pinhole

BARE = Scene(np.array([16.0, 10.0]))
DARK = Light(shadow=0.0)
CALM = Picture(noise=0.0, blur_px=0.0)


def small(camera: Camera, share: float = 0.5) -> Camera:
    """The same view on fewer or more pixels."""
    width, height = (round(share * n) for n in camera.image)
    focal = (camera.focal_px[0] * share, camera.focal_px[1] * share)
    return camera.replace(
        image=(width, height), focal_px=focal, centre_px=(width / 2, height / 2), px_per_m=camera.px_per_m * share
    )


VIEWS = {"high": small(pinhole()).replace(baseline=0.5), "above": small(above())}


def motion_in(people: int = 6) -> Motion:
    return crowd(3, people=people, frames=12, scene=BARE)


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("share", [0.0, 0.03, 0.2])
def test_plants_cover_the_share_that_is_wanted(view: str, share: float) -> None:
    found = [
        make_renderer(
            motion_in(1).replace(seed=seed), VIEWS[view], DARK, Picture(foliage=share)
        ).left_view.empty_scene.plants.mean()
        for seed in range(3)
    ]
    assert found == pytest.approx([share] * 3, abs=0.01)


def test_more_samples_show_leaves_farther_away_and_cover_the_same_share() -> None:
    near, far = (
        make_renderer(motion_in(1), VIEWS["high"], DARK, Picture(foliage=0.08, samples=n)).left_view for n in (1, 3)
    )
    assert far.empty_scene.plants.mean() == pytest.approx(0.08, abs=0.01)
    reach = [view.geometry.depth[view.empty_scene.plants > 0].max() for view in (near, far)]
    assert reach[1] > reach[0]


def test_plants_grow_outside_the_world_first() -> None:
    made = make_renderer(motion_in(1), VIEWS["high"], DARK, Picture(foliage=0.08)).left_view
    x, y = np.moveaxis(made.geometry.place[..., :2], -1, 0)
    inside = (x > 0) & (x < 16) & (y > 0) & (y < 10)
    assert made.empty_scene.plants[inside].mean() < 0.25 * made.empty_scene.plants[~inside].mean()


@pytest.mark.parametrize("view", VIEWS)
def test_only_plants_move_and_where_wind_takes_them(view: str) -> None:
    empty = motion_in(0)
    picture = CALM.model_copy(update={"foliage": 0.15, "sway_px": 2.0})
    made = make_renderer(empty, VIEWS[view], DARK, picture)
    scene, share = made.left_view, made.left_view.empty_scene.plants.astype(float)
    still = make_renderer(empty, VIEWS[view], DARK, picture.model_copy(update={"sway_px": 0.0}))
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


def test_blur_reaches_what_plants_uncover() -> None:
    import cv2

    gale = Picture(noise=0.0, texture=0.4, foliage=0.1, sway_px=20.0)
    sharp, soft = (
        make_renderer(motion_in(0), VIEWS["high"], DARK, gale.model_copy(update={"blur_px": sd})).frame(4)
        for sd in (0.0, 2.0)
    )
    wanted = cv2.GaussianBlur(sharp, (13, 13), 2.0, borderType=cv2.BORDER_REPLICATE)
    assert np.abs(wanted.astype(float) - soft).max() <= 1.5


def test_sway_has_its_sd_and_its_time() -> None:
    t = np.arange(0, 30, 0.2)
    path = []
    for seed in range(40):
        made = make_renderer(
            motion_in(0).replace(seed=seed), VIEWS["high"], DARK, Picture(foliage=0.1, sway_px=3.0, sway_time=0.4)
        )
        path.append([made.left_view.wind(x)[:, ::8, ::8].ravel() for x in t])
    sway = np.array(path)
    assert sway.std() == pytest.approx(3.0, rel=0.06)
    lag = (sway[:, 2:] * sway[:, :-2]).mean() / (sway**2).mean()
    assert lag == pytest.approx(np.exp(-0.5), abs=0.05)
    strength = (sway**2).mean(axis=2) ** 0.5  # gusts
    assert np.percentile(strength, 95) > 2 * np.percentile(strength, 5)


def test_both_cameras_see_one_wind_and_the_same_plants() -> None:
    made = make_renderer(motion_in(0), VIEWS["high"], DARK, Picture(foliage=0.2))
    left, right = made.left_view, made.right_view
    d = made.pixels(1, disparity=True).disparity
    assert d is not None
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
    quiet = make_renderer(motion, VIEWS["high"], DARK, CALM)
    restless = make_renderer(motion, VIEWS["high"], DARK, CALM.model_copy(update={"foliage": 0.3}))
    a, b = (made.pixels(5, disparity=True) for made in (quiet, restless))
    assert canonical_hash(a) == canonical_hash(b)
    assert np.array_equal(quiet.frame(5)[a.ids > 0], restless.frame(5)[a.ids > 0])


def test_a_field_is_alike_over_its_length_and_passes_at_its_speed() -> None:
    places, no = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 4.0]]), np.zeros(3)
    fields = [moving_pattern(np.random.default_rng(k), 0.2, 4.0, 2.0) for k in range(3000)]
    now, later = (np.array([f.sampled(places, no).at(t) for f in fields]) for t in (0.0, 2.0))
    assert now.std() == pytest.approx(0.2, rel=0.03)
    assert (now[:, 0] * now[:, 1]).mean() / 0.04 == pytest.approx(np.exp(-0.5), abs=0.05)
    assert (now[:, 0] * later[:, 0]).mean() / 0.04 == pytest.approx(np.exp(-0.5), abs=0.05)  # 2 s at 2 m/s
    far = np.array([f.sampled(places, np.full(3, 4.0)).at(0.0) for f in fields])
    assert far.var() / 0.04 == pytest.approx(1 / 3, rel=0.1)  # E exp(-|k|² s²) = 1 / (1 + 2 s²/length²)
    assert np.allclose(fields[0].sampled(places, no).at(1.5)[0], fields[0].at_origin(1.5))
    to_and_fro = [oscillation(np.random.default_rng(k), 1.0, 1.0, 0.5) for k in range(3000)]
    pair = np.array([[f.at_origin(0.0), f.at_origin(0.5)] for f in to_and_fro])
    assert (pair[:, 0] * pair[:, 1]).mean() == pytest.approx(np.exp(-0.5), abs=0.06)


@pytest.mark.parametrize("view", VIEWS)
def test_clouds_pass_over_the_ground(view: str) -> None:
    light = Light(shadow=0.0, cloud=0.15, cloud_size=5.0)
    made, clear = (make_renderer(motion_in(0), VIEWS[view], one, CALM) for one in (light, DARK))
    place = made.left_view.geometry.place[..., :2].astype(float)
    plain = clear.frame(1).astype(float).sum(axis=2)
    near = (np.abs(place - [8, 5]) < [8, 5]).all(axis=2)
    for index in (1, 12):
        flat = place[near]
        wanted = np.exp(draw_illumination(light, 7).clouds.sampled(flat, np.zeros(len(flat))).at((index - 1) / 10))
        image = made.frame(index).astype(float)
        found, shown = image.sum(axis=2)[near] / plain[near], (image < 255).all(axis=2)[near]
        assert shown.mean() > 0.8
        assert np.abs(found - wanted)[shown].max() < 0.04
        assert wanted.std() > 0.03
    assert not np.array_equal(made.frame(1), made.frame(12))


def test_clouds_fade_where_patches_are_finer_than_pixels() -> None:
    low = small(pinhole(3.0, at=(8.0, -5.0, 2.0)))
    bright = make_renderer(motion_in(0), low, Light(cloud=0.3, cloud_size=2.0), CALM).left_view.brightness(0.0, 1)
    assert bright[0] == pytest.approx(1.0, abs=1e-6)  # the sky
    assert np.abs(np.log(bright[-1])).max() > 0.05
    assert np.isfinite(bright).all()


@pytest.mark.parametrize("shot", [0.0, 0.5, 1.0])
def test_noise_grows_with_brightness_by_the_share_of_shot_noise(shot: float) -> None:
    motion, camera = motion_in(0), small(pinhole(60.0))
    for gain in (0.4, 1.0):
        light = Light(shadow=0.0, switch=({"at": -100, "gain": gain},))  # type: ignore[arg-type]
        made = make_renderer(motion, camera, light, Picture(noise=4.0, shot=shot, texture=0.0))
        level = make_renderer(motion, camera, light, Picture(noise=0.0, texture=0.0)).background(0).astype(float)
        empty = np.stack([made.background(k) for k in range(BACKGROUNDS)]).astype(float)
        wanted = 16.0 * (1 - shot + shot * level.mean() / 128) + 1 / 12  # rounding's own
        assert empty.var(axis=0, ddof=1).mean() == pytest.approx(wanted, rel=0.04)


def test_lossy_artefacts_come_last_and_change_from_frame_to_frame() -> None:
    import cv2

    motion, camera, light = motion_in(), VIEWS["high"], Light(drift=0.1, cloud=0.05)
    raw, lossy = (make_renderer(motion, camera, light, Picture(jpeg=q, foliage=0.1)) for q in (0, 60))
    for index in (2, 3):
        code = cv2.imencode(".jpg", raw.frame(index), [cv2.IMWRITE_JPEG_QUALITY, 60])[1]
        assert np.array_equal(cv2.imdecode(code, cv2.IMREAD_COLOR), lossy.frame(index))
    off = lossy.background(1).astype(float) - lossy.background(0)
    assert (off != 0).mean() > 0.3
    across = np.abs(np.diff(off, axis=1)).mean(axis=(0, 2))  # steps at the edges of blocks
    edge = np.arange(len(across)) % 8 == 7
    assert across[edge].mean() > 1.15 * across[~edge].mean()


def test_the_plate_is_that_of_finer_rays() -> None:
    """One ray a pixel, four where surfaces meet, against 3 x 3 times as many pixels."""
    built = Scene(
        np.array([16.0, 10.0]), walls=np.array([[[4.0, 3.0], [7.0, 3.4]]]), pillars=np.array([[8.0, 2.5, 0.3]])
    )
    motion = crowd(3, people=0, frames=1, scene=built)
    coarse = make_renderer(motion, VIEWS["high"], Light(shadow=0.5), Picture(texture=0.0)).left_view.empty_scene.colour
    fine = make_renderer(
        motion, small(pinhole(), 1.5), Light(shadow=0.5), Picture(texture=0.0)
    ).left_view.empty_scene.colour
    height, width = coarse.shape[:2]
    mean = fine.reshape(height, 3, width, 3, 3).mean(axis=(1, 3))
    off = np.abs(mean - coarse).max(axis=2)
    assert off.mean() < 0.25
    assert np.percentile(off, 99.9) < 25


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("samples", [2, 3])
def test_a_pixel_is_the_mean_of_its_samples(view: str, samples: int) -> None:
    """Against as many times more pixels, each with one ray, on ground without grass."""
    motion = crowd(3, people=0, frames=1, scene=Scene(np.array([2000.0, 2000.0])))
    camera, picture = VIEWS[view], Picture(texture=0.8)
    camera = camera.replace(position=camera.position + np.array([1000.0, 1000.0, 0.0]))
    made = make_renderer(motion, camera, DARK, picture.model_copy(update={"samples": samples})).left_view.empty_scene
    fine = make_renderer(motion, small(camera, samples), DARK, picture).left_view.empty_scene
    height, width = made.direct.shape
    mean = fine.colour.reshape(height, samples, width, samples, 3).mean(axis=(1, 3))
    assert np.abs(mean - made.colour).max() < 1e-3


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match="foliage"):
        make_renderer(motion_in(0), VIEWS["high"], DARK, Picture(foliage=1.5)).frame(1)
    with pytest.raises(ValueError, match="foliage"):
        make_renderer(motion_in(0), VIEWS["high"], DARK, Picture(foliage=-0.1)).frame(1)
    with pytest.raises(ValueError, match="cloud"):
        make_renderer(motion_in(0), VIEWS["high"], Light(cloud=-0.1)).frame(1)


def test_no_ground_near_enough_has_no_plants() -> None:
    far = small(pinhole(90.0, at=(8.0, 5.0, 400.0)))
    made = make_renderer(motion_in(0), far, DARK, Picture(foliage=0.2))
    assert made.left_view.plants is None
    assert made.frame(1).shape == (240, 320, 3)
