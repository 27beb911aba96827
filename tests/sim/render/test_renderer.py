"""Pictures against a slow renderer, and the promises of a Renderer."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.schema.pictures import Light, LightSwitch, Picture
from sim.hashing import canonical_hash
from sim.render.renderer import BACKGROUNDS, Renderer
from sim.scene.boxes import check_nobody_in_boxes
from sim.truth.label import bodies
from sim.types import Array, Box, Motion, Scene, Stairs
from tests import reference_render as slow
from tests.reference_sense import above, crowd, pinhole, small, walkers

STAIRS = Stairs(np.array([9.0, 5.0]), np.array([12.0, 6.0]), 3.0, 1.2, 6, 2.0)
BARE = Scene(np.array([16.0, 10.0]))
BUILT = Scene(
    np.array([16.0, 10.0]), walls=np.array([[[4.0, 3.0], [7.0, 3.4]], [[2.0, 9.0], [14.0, 9.0]]]),
    pillars=np.array([[8.0, 2.5, 0.3], [11.0, 3.0, 0.2]]), stairs=(STAIRS,),
)  # fmt: skip
SHARP = Picture(noise=0.0, blur_px=0.0)


def box(at: list[float], size: list[float], turn: float = 0.0, tilt: float = 0.0, **looks: Any) -> Box:
    looks = {"colour": np.array([120.0, 160.0, 200.0]), "pattern": "plain", "period": 0.4, "gloss": 0.0} | looks
    return Box(np.array(at), np.array(size), turn, tilt, **looks)


STORED = Scene(
    np.array([16.0, 10.0]), pillars=np.array([[11.0, 3.0, 0.2]]),
    boxes=(
        box([6.0, 3.0, 0.5], [1.5, 0.8, 1.0], 30.0), box([9.0, 4.0, 1.4], [2.0, 0.1, 1.4], -40.0, 35.0),
        box([8.0, 2.0, 0.9], [0.05, 0.05, 1.8], 10.0, -20.0), box([11.0, 7.0, 2.0], [3.0, 0.06, 0.06], 15.0),
    ),
)  # fmt: skip


VIEWS = {
    "high": small(pinhole(40.0)).replace(baseline=0.5),
    "low": small(pinhole(12.0, at=(8.0, -5.0, 2.2))).replace(baseline=0.5),
    "turned": small(pinhole(30.0, yaw=35.0, at=(15.0, -4.0, 6.0))).replace(baseline=0.3),
    "above": small(above(20.0), 0.5),
}
SCENES = {"bare": BARE, "built": BUILT, "boxes": STORED}


def motion_in(scene: Scene, people: int = 14) -> Motion:
    return crowd(3, people=people, frames=12, scene=scene)


@cache
def slowly_seen(view: str, scene: str) -> slow.Seen:
    return slow.look(VIEWS[view], motion_in(SCENES[scene]), 5)


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("view", VIEWS)
def test_ids_masks_and_counts_are_those_of_a_slow_renderer(view: str, scene: str) -> None:
    motion, camera = motion_in(SCENES[scene]), VIEWS[view]
    seen, pixels = slowly_seen(view, scene), Renderer(motion, camera).pixels(5)
    assert (seen.ids > 0).sum() > 300  # the oracle sees somebody
    assert (pixels.ids != seen.ids).sum() <= 2  # a ray that grazes two things
    ids = np.flatnonzero(motion.present[4]) + 1
    for k, person in enumerate(ids):
        assert abs(pixels.amodal_px[k] - seen.amodal[int(person)].sum()) <= 1
        modal = pixels.ids == int(person)
        assert pixels.visible_px[k] == modal.sum()
        if modal.any():
            v, u = np.nonzero(modal)
            wanted = [u.min(), v.min(), u.max() + 1 - u.min(), v.max() + 1 - v.min()]
            assert pixels.box[k].tolist() == wanted
        else:
            assert np.isnan(pixels.box[k]).all()


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("view", ["high", "low", "turned"])
def test_disparities_are_those_of_a_slow_renderer(view: str, scene: str) -> None:
    motion, camera = motion_in(SCENES[scene]), VIEWS[view]
    wanted = slow.disparity(slowly_seen(view, scene), camera, motion, 5)
    found = Renderer(motion, camera).pixels(5, disparity=True).disparity
    assert np.isnan(wanted).sum() > 100
    both = np.isfinite(wanted) & np.isfinite(found)
    assert (np.isfinite(wanted) != np.isfinite(found)).sum() <= 12  # of 19,200: grazing rays, and 1 mm of depth
    off = np.abs(wanted - found)[both]
    assert np.sort(off)[-3] < 1e-4
    assert np.isnan(found).sum() == pytest.approx(np.isnan(wanted).sum(), abs=12)


def test_blobs_are_connected_regions() -> None:
    import cv2

    motion = motion_in(BUILT, 25)
    pixels = Renderer(motion, VIEWS["low"]).pixels(5)
    _, label = cv2.connectedComponents((pixels.ids > 0).astype(np.uint8), connectivity=8)
    ids = np.flatnonzero(motion.present[4]) + 1
    regions = {int(i): set(label[pixels.ids == i].tolist()) for i in ids}
    for a, ra in zip(ids, pixels.blob, strict=True):
        assert (ra == -1) == (not regions[int(a)])
        for b, rb in zip(ids, pixels.blob, strict=True):
            if regions[int(a)] & regions[int(b)]:
                assert ra == rb
    assert len(set(pixels.blob.tolist()) - {-1}) <= label.max()
    assert len(set(pixels.blob.tolist()) - {-1}) > 3


@pytest.mark.parametrize("view", ["high", "above"])
def test_shadows_fall_where_somebody_stands_before_the_sun(view: str) -> None:
    motion, camera = motion_in(BARE), VIEWS[view]
    made = Renderer(motion, camera, Light(shadow=0.5, penumbra=0.0), SHARP)
    seen, sun = slowly_seen(view, "bare"), made.illumination.sun
    shadow = slow.in_shadow(seen.place, motion, 5, sun) & (seen.ids == 0) & np.isfinite(seen.depth)
    ground = (seen.ids == 0) & ~shadow
    empty = np.clip(made.left_view.empty_scene.colour, 0, 255)
    ratio = made.frame(5).astype(float).sum(2) / empty.sum(2)
    assert shadow.sum() > 200
    assert (np.abs(ratio[shadow] - 0.5) > 0.03).mean() < 0.01
    assert (np.abs(ratio[ground] - 1.0) > 0.03).mean() < 0.001


def test_frames_are_pure_functions_of_their_index() -> None:
    motion, camera = motion_in(BUILT), VIEWS["high"]
    light = Light(drift=0.1, flicker=0.02, cloud=0.1, switch=(LightSwitch(at=0.5, gain=0.7),))
    picture = Picture(jpeg=80, foliage=0.1)
    one, two = (Renderer(motion, camera, light, picture) for _ in range(2))
    forwards = [one.draw(i, right=True, pixels=True, disparity=True) for i in range(1, 5)]
    for i in (3, 1, 4, 2):
        other = forwards[i - 1]
        assert np.array_equal(two.frame(i), other.image)
        assert np.array_equal(two.right(i), other.right)
        assert canonical_hash(two.pixels(i, disparity=True)) == canonical_hash(other.pixels)
        assert np.array_equal(Renderer(motion, camera, light, picture).frame(i), other.image)
    assert not np.array_equal(forwards[0].image, forwards[0].right)
    assert np.array_equal(one.background(7), two.background(7))


def test_one_person_more_changes_nobody_else() -> None:
    whole = motion_in(BARE, 7)
    without = whole.replace(present=whole.present & (np.arange(7) < 6))
    few, many = (Renderer(m, VIEWS["high"], Light(shadow=0), SHARP) for m in (without, whole))
    others = many.pixels(3).ids != 7
    assert (~others).sum() > 20
    assert np.array_equal(few.frame(3)[others], many.frame(3)[others])


def test_noise_is_normal_independent_and_the_same_in_empty_frames() -> None:
    motion, camera = motion_in(BARE, 3), small(pinhole(60.0))
    made = Renderer(motion, camera, Light(), Picture(noise=4.0, shot=0.0, texture=0.0))
    empty = np.stack([made.background(k) for k in range(BACKGROUNDS)]).astype(float)
    noise = empty - empty.mean(axis=0)
    assert noise.std() == pytest.approx(4.0 * np.sqrt(1 - 1 / BACKGROUNDS), rel=0.02)
    flat = noise.reshape(BACKGROUNDS, -1)
    for lag in ((0, 0, 1), (0, 1, 0), (1, 0, 0)):  # next colour, pixel, row
        shifted = np.roll(noise, lag, axis=(1, 2, 3))
        assert abs((noise * shifted).mean()) < 0.02 * noise.var()
    assert abs((flat[1:] * flat[:-1]).mean()) < 0.03 * noise.var()
    assert np.percentile(np.abs(noise), 99.7) == pytest.approx(3 * 4.0, rel=0.05)
    right = Renderer(motion, camera, Light(), Picture(noise=4.0)).right(4).astype(float)
    left = Renderer(motion, camera, Light(), Picture(noise=4.0)).frame(4).astype(float)
    clean = Renderer(motion, camera, Light(), Picture(noise=0.0))
    a, b = left - clean.frame(4), right - clean.right(4)
    assert abs((a * b).mean()) < 0.03 * a.std() * b.std()


def test_light_changes_as_it_is_told() -> None:
    motion, camera = motion_in(BARE, 3), VIEWS["high"]
    steady = Renderer(motion, camera, Light(), SHARP)
    switched = Renderer(motion, camera, Light(switch=(LightSwitch(at=0.5, gain=0.6, ramp=0.2),)), SHARP)
    share = [switched.frame(i).mean() / steady.frame(i).mean() for i in (1, 6, 7, 8, 12)]
    assert share == pytest.approx([1, 1, np.sqrt(0.6), 0.6, 0.6], abs=0.01)
    assert np.array_equal(switched.background(49), steady.background(49))


def test_both_cameras_see_the_same_surfaces() -> None:
    motion, camera = motion_in(BUILT), VIEWS["high"]
    made = Renderer(motion, camera, Light(), SHARP)
    left, right, d = made.frame(3), made.right(3), made.pixels(3, disparity=True).disparity
    v, u = np.nonzero(np.isfinite(d))
    x = np.clip(u - d[v, u], 0, 158.0)
    low = np.floor(x).astype(int)
    there = right[v, low] * (1 - (x - low))[:, None] + right[v, low + 1] * (x - low)[:, None]
    off = np.abs(left[v, u] - there).mean(axis=1)
    assert np.median(off) < 3.0
    wrong = np.abs(left[v, u].astype(float) - right[v, u]).mean(axis=1)
    assert np.median(wrong) > 2 * np.median(off)


def test_a_misaligned_right_camera_turns_and_moves_its_picture_only() -> None:
    import cv2

    motion, camera = motion_in(BUILT), VIEWS["high"]
    plain = Renderer(motion, camera, Light(), SHARP).draw(3, right=True, pixels=True, disparity=True)
    picture = SHARP.model_copy(update={"right_roll_deg": 2.0, "right_down_px": 1.5, "right_gain": 1.1})
    wrong = Renderer(motion, camera, Light(), picture).draw(3, right=True, pixels=True, disparity=True)
    assert np.array_equal(plain.image, wrong.image)
    assert np.array_equal(plain.pixels.disparity, wrong.pixels.disparity, equal_nan=True)
    matrix = cv2.getRotationMatrix2D((camera.centre_px[0] - 0.5, camera.centre_px[1] - 0.5), -2.0, 1.0)
    matrix[1, 2] += 1.5
    expected = 1.1 * cv2.warpAffine(plain.right, matrix, plain.right.shape[1::-1], flags=cv2.INTER_CUBIC).astype(float)
    inside = np.s_[10:-10, 10:-10]
    off = np.abs(np.minimum(expected, 255) - wrong.right)[inside]
    assert np.median(off) < 3.0
    assert np.median(off) < 0.4 * np.median(np.abs(plain.right.astype(float) - wrong.right)[inside])


@pytest.mark.parametrize("scene", SCENES)
def test_geometric_visibility_is_that_of_the_pixels(scene: str) -> None:
    motion, camera = crowd(5, people=14, frames=3, scene=SCENES[scene]), pinhole(25.0, at=(8.0, -6.0, 4.5))
    truth, pixels = bodies(motion, camera), Renderer(motion, camera).pixels(2)
    here = truth.rows(2)
    assert np.abs(truth.visibility[here] - pixels.visibility).max() < 0.06
    whole = pixels.visibility == 1
    assert np.abs(truth.box[here] - pixels.box)[whole].max() <= 1.0


@pytest.mark.parametrize("rise", [1.6, -1.6])
def test_stairs_hide_people_in_geometry_as_in_pixels(rise: float) -> None:
    flight = Stairs(np.array([6.0, 6.0]), np.array([9.0, 6.0]), 3.0, rise, 8, 2.0)
    scene = Scene(np.array([16.0, 10.0]), stairs=(flight,))
    x, y = np.meshgrid(np.linspace(5.0, 11.5, 9), [3.8, 5.0, 6.0, 7.0, 8.2, 9.0])  # before, on and behind the flight
    motion = walkers(np.column_stack([x.ravel(), y.ravel()]), np.full((x.size, 2), 0.3), frames=2, scene=scene)
    camera = pinhole(15.0, at=(8.0, -5.0, 3.2))
    truth, pixels = bodies(motion, camera), Renderer(motion, camera).pixels(1)
    off = truth.visibility[truth.rows(1)] - pixels.visibility
    assert np.abs(off).max() < 0.06
    alone = Renderer(motion.replace(scene=BARE), camera).pixels(1)
    assert (pixels.visible_px < 0.7 * alone.visible_px).sum() >= 3  # they do hide somebody


def test_what_cannot_be_drawn_is_refused() -> None:
    motion = motion_in(BARE, 2)
    with pytest.raises(InputError, match="radial"):
        Renderer(motion, VIEWS["high"].replace(radial=0.1))
    with pytest.raises(InputError, match="baseline"):
        Renderer(motion, VIEWS["high"].replace(baseline=0.0)).right(1)
    with pytest.raises(InputError, match="baseline"):
        Renderer(motion, VIEWS["above"].replace(baseline=0.1)).right(1)
    with pytest.raises(ValueError, match="sun_elevation_deg"):
        Light(sun_elevation_deg=-5.0)
    with pytest.raises(ValueError, match="gain"):  # of pydantic
        Renderer(motion, VIEWS["high"], Light(switch=(LightSwitch(at=1.0, gain=-1.0),))).frame(1)


def test_nobody_behind_the_camera_and_no_people_at_all() -> None:
    motion = motion_in(BARE, 5)
    behind = small(pinhole(20.0, at=(8.0, 12.0, 3.0)))
    pixels = Renderer(motion, behind).pixels(1)
    assert not (pixels.ids > 0).any()
    assert pixels.amodal_px.tolist() == [0.0] * 5
    assert pixels.blob.tolist() == [-1] * 5
    nobody = crowd(0, people=0, frames=2)
    assert Renderer(nobody, VIEWS["high"]).draw(1, pixels=True, right=True, disparity=True).pixels is not None


def test_sky_is_above_the_horizon_and_has_no_disparity() -> None:
    made = Renderer(motion_in(BARE, 2), small(pinhole(5.0, at=(8.0, -6.0, 2.0))))
    pixels = made.pixels(1, disparity=True)
    assert np.isnan(pixels.disparity[0]).all()
    assert made.frame(1)[0].mean() > made.frame(1)[-1].mean()


def test_people_wear_the_colours_that_they_are_given() -> None:
    """Of the others not a pixel changes."""
    motion, camera = motion_in(BARE), VIEWS["high"]
    clothes = np.full((len(motion.height), 2, 3), np.nan)
    clothes[0] = [[250, 10, 10], [10, 10, 250]]
    plain, dressed = (Renderer(m, camera, Light(shadow=0.0), SHARP).draw(5, pixels=True) for m in (
        motion, motion.replace(clothes=clothes)
    ))  # fmt: skip
    changed = (plain.image != dressed.image).any(axis=2)
    assert (dressed.pixels.ids[changed] == 1).all()
    v, u = np.nonzero(dressed.pixels.ids == 1)
    upper, lower = (dressed.image[v[rows], u[rows]].astype(float) for rows in (v < np.median(v), v > np.median(v)))
    assert np.median(upper[:, 2] - upper[:, 0]) > 60, "red"
    assert np.median(lower[:, 0] - lower[:, 2]) > 60, "blue"


def front_of(gloss: float = 0.0, **looks: Any) -> Array:
    """The upper half of a side that fills the middle of the picture, in grey, as both cameras see it: (2, 60, 60)."""
    board = box([8.0, 4.0, 2.0], [6.0, 0.1, 4.0], gloss=gloss, **looks)
    motion = walkers(np.zeros((1, 2)), np.zeros((1, 2)), frames=1, scene=BARE.replace(boxes=(board,)))
    camera = small(pinhole(0.0, at=(8.0, -2.0, 2.0))).replace(baseline=0.5)
    drawn = Renderer(motion, camera, Light(shadow=0.0), SHARP).draw(1, right=True)
    assert drawn.image is not None
    assert drawn.right is not None
    return np.stack([image[20:60, 60:100].astype(float).mean(axis=2) for image in (drawn.image, drawn.right)])


def test_patterns_of_boxes_are_plain_or_repeat_exactly() -> None:
    left, right = front_of(pattern="plain")
    assert left.std() < 0.5
    assert abs(left - right).max() < 1
    assert front_of(pattern="grain")[0].std() > 3
    period = 10 * (3.95 + 2.0) / 125  # m: 10 px on the side, 5.95 m away
    stripes = front_of(pattern="stripes", period=period)[0]
    assert stripes.std(axis=0).max() < 0.5  # along a stripe
    assert np.ptp(stripes) > 20
    assert abs(stripes[:, 10:] - stripes[:, :-10]).max() < 1
    checks = front_of(pattern="checks", period=0.8)[0]
    assert checks.std(axis=0).min() > 3
    assert checks.std(axis=1).min() > 3


def test_what_a_glossy_side_mirrors_is_no_part_of_its_surface() -> None:
    mat, glossy = front_of(), front_of(gloss=0.5)
    assert abs(mat[0] - mat[1]).max() < 1  # of one colour: both cameras see the same
    assert abs(glossy[0] - mat[0]).mean() > 5
    assert glossy[0].std() > 2 * mat[0].std()


def test_who_walks_into_a_box_is_refused() -> None:
    scene = BARE.replace(boxes=(box([3.0, 4.0, 1.0], [1.0, 1.0, 2.0], 45.0), box([8.0, 4.0, 2.6], [9.0, 9.0, 0.2])))
    check_nobody_in_boxes(walkers(np.array([[3.0, 2.0], [8.0, 4.0]]), np.zeros((2, 2)), frames=2, scene=scene))
    with pytest.raises(InputError, match=r"world.boxes.0 .*person 2 in it in frame 1 at \(3.0, 3.2\)"):
        check_nobody_in_boxes(walkers(np.array([[3.0, 2.0], [3.0, 3.2]]), np.zeros((2, 2)), frames=2, scene=scene))
