"""A camera that moves is found in pictures, which are then laid on the background."""

from __future__ import annotations

import warnings

import cv2
import numpy as np
import pytest

from sim.types import Array, Context, Frame, GroupEvent, Groups, Image, Tracks
from tracking.detect import camera_motion as motion
from tracking.detect.background_settings import BackgroundSettings
from tracking.detect.foreground import Foreground
from tracking.papers.blob.tracker import Blob

SIZE = (160, 120)  # width, height


def wide(seed: int = 0) -> Image:
    """A picture of patches, larger than SIZE by 100 px on each side."""
    drawn = np.random.default_rng(seed).uniform(40, 200, (40, 45, 3)).astype(np.float32)
    return np.asarray(cv2.resize(drawn, (SIZE[0] + 200, SIZE[1] + 200), interpolation=cv2.INTER_CUBIC), np.float32)


def seen(scene: Image, right: float, down: float, noise: int = 0, people: tuple[tuple[int, int], ...] = ()) -> Image:
    """What a camera sees that has moved to the right and down by so many px; people: of dark boxes in the scene."""
    scene = scene.copy()
    for u, v in people:
        scene[v : v + 24, u : u + 9] = 15
    step = np.array([[1, 0, -100.0 - right], [0, 1, -100.0 - down]])
    picture = cv2.warpAffine(scene, step, SIZE, flags=cv2.INTER_CUBIC)
    return np.asarray(np.clip(picture + np.random.default_rng(noise).normal(0, 2, picture.shape), 0, 255), np.uint8)


def shake(k: int) -> tuple[float, float]:
    return 7 * np.sin(1.9 * k), 5 * np.cos(2.3 * k)


def context(sample: Image, px_per_m: float = 14.0) -> Context:
    return Context(10.0, px_per_m, None, None, SIZE, sample)


@pytest.mark.parametrize("by", [(0.0, 0.0), (6.0, -3.5), (-9.3, 8.0)])
def test_a_picture_is_laid_where_it_was_taken(by: tuple[float, float]) -> None:
    scene = wide()
    corners = motion.corners_of(motion.grey(seen(scene, 0, 0)))
    found = motion.laid_on(corners, motion.grey(seen(scene, *by, noise=1)), np.eye(3))
    assert found is not None
    middle = np.array([80.0, 60.0])
    assert motion.mapped(found, middle) - middle == pytest.approx(by, abs=0.2)


def test_people_who_cross_do_not_move_the_picture() -> None:
    scene = wide()
    first = seen(scene, 0, 0, 1, ((110, 130), (200, 150), (150, 170)))
    then = seen(scene, 0, 0, 2, ((114, 130), (204, 150), (154, 170)))
    found = motion.laid_on(motion.corners_of(motion.grey(first)), motion.grey(then), np.eye(3))
    assert found is not None
    assert motion.movement(found, SIZE) < 0.3


def test_people_in_front_of_a_bare_wall_tell_nothing() -> None:
    """All corners are people's, who walk one way: the wall is as good a background as before."""
    wall = np.full_like(wide(), 120.0)
    sample = np.stack([seen(wall, 0, 0, k, tuple((110 + 3 * k, 120 + 30 * n) for n in range(4))) for k in range(20)])
    assert motion.poses_of_sample(sample) is None


def test_a_still_sample_has_no_poses_and_a_moved_one_those_it_was_taken_with() -> None:
    scene = wide()
    assert motion.poses_of_sample(np.stack([seen(scene, 0, 0, k) for k in range(20)])) is None
    poses = motion.poses_of_sample(np.stack([seen(scene, *shake(k), k) for k in range(20)]))
    assert poses is not None
    reference, middle = np.array(shake(10)), np.array([80.0, 60.0])
    for k, pose in enumerate(poses):
        assert pose is not None
        assert motion.mapped(pose, middle) - middle == pytest.approx(np.array(shake(k)) - reference, abs=0.3)


def test_a_long_way_is_found_piece_by_piece() -> None:
    scene = wide()
    poses = motion.poses_of_sample(np.stack([seen(scene, 6.0 * (k - 10), 0, k) for k in range(20)]))
    assert poses is not None
    assert poses[0] is not None
    assert poses[0][0, 2] == pytest.approx(-60, abs=1)


def test_equal_runs_are_equal() -> None:
    sample = np.stack([seen(wide(), *shake(k), k) for k in range(12)])
    a, b = motion.poses_of_sample(sample), motion.poses_of_sample(sample)
    assert a is not None
    assert b is not None
    assert all(np.array_equal(x, y) for x, y in zip(a, b, strict=True))


def foreground(sample: Image, moves: bool) -> Foreground:
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        made = Foreground(context(sample), BackgroundSettings())
    assert (["the camera moves" in str(one.message) for one in said]) == [True] * moves
    return made


def test_the_background_of_a_shaken_camera_is_as_clean_as_that_of_a_still_one() -> None:
    scene = wide()
    pipeline = foreground(np.stack([seen(scene, *shake(k), k) for k in range(30)]), moves=True)
    more = []
    for k in range(30, 40):
        person = (170, 160)
        found = pipeline.segment(seen(scene, *shake(k), k, (person,)))
        assert found.plausible
        blobs = pipeline.person_blobs(found.mask)
        more.append(blobs.area[1:].sum() / blobs.area[0])
        assert pipeline.stabiliser is not None
        box = motion.boxes_after(np.linalg.inv(pipeline.stabiliser.pose), blobs.box[:1])
        expected = [person[0] - 100 - shake(k)[0], person[1] - 100 - shake(k)[1], 9, 24]
        assert box[0] == pytest.approx(expected, abs=3)
    assert np.mean(more) < 0.1


def test_a_camera_that_begins_to_move_is_found_and_said_once() -> None:
    scene = wide()
    pipeline = foreground(np.stack([seen(scene, 0, 0, k) for k in range(20)]), moves=False)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        for k in range(20, 50):
            assert not pipeline.segment(seen(scene, 0, 0, k)).mask.any()
        assert not said
        for k in range(50, 80):
            found = pipeline.segment(seen(scene, *shake(k), k))
    assert len(said) == 1
    assert found.mask.mean() < 0.02


def test_a_still_camera_keeps_every_bit() -> None:
    scene = wide()
    pipeline = foreground(np.stack([seen(scene, 0, 0, k) for k in range(20)]), moves=False)
    for k in range(20, 40):
        image = seen(scene, 0, 0, k, ((100 + 4 * k, 150),))
        assert np.shares_memory(pipeline.segment(image).image, image)
    assert pipeline.take_step() is None


def test_a_turning_camera_takes_its_background_along() -> None:
    scene = wide()
    pipeline = foreground(np.stack([seen(scene, 2.0 * (k - 30), 0, k) for k in range(30)]), moves=True)
    way, foreground_share = np.eye(3), []
    for k in range(30, 70):
        found = pipeline.segment(seen(scene, 2.0 * (k - 30), 0, k))
        pipeline.adapt(found, np.zeros(found.mask.shape, bool))
        step = pipeline.take_step()
        way = way if step is None else step @ way
        assert found.plausible
        foreground_share.append(found.mask.mean())
    assert np.mean(foreground_share) < 0.05
    assert pipeline.stabiliser is not None
    assert np.abs(pipeline.stabiliser.pose[:2, 2]).max() < 15
    total = pipeline.stabiliser.pose[0, 2] - way[0, 2]
    assert total == pytest.approx(2.0 * (69 - 15), abs=3)


def test_pictures_that_cannot_be_laid_become_the_background() -> None:
    """Half a second after the camera looks elsewhere, all at once."""
    scene, other = wide(), wide(1)
    pipeline = foreground(np.stack([seen(scene, *shake(k), k) for k in range(30)]), moves=True)
    plausible, share = [], []
    for k in range(30, 50):
        found = pipeline.segment(seen(other, *shake(k), k))
        pipeline.adapt(found, np.zeros(found.mask.shape, bool))
        plausible.append(found.plausible)
        share.append(found.mask.mean())
    assert plausible == [False] * 4 + [True] * 16
    assert max(share[5:]) < 0.05


def test_the_tracks_of_a_shaken_camera_are_in_the_picture() -> None:
    scene = wide()
    sample = np.stack([seen(scene, *shake(k), k) for k in range(30)])
    tracker = Blob()
    with pytest.warns(UserWarning, match="the camera moves"):
        tracker.reset(context(sample), 0)
    reported = []
    for k in range(30, 70):
        at = (120 + 2 * (k - 30), 160)
        tracks = tracker.step(Frame(k - 29, (k - 30) / 10, seen(scene, *shake(k), k, (at,))), None)
        if len(tracks.id) and k > 45:
            assert tracks.box is not None
            middle = tracks.box[0, :2] + tracks.box[0, 2:] / 2
            reported.append(middle - (at[0] + 4.5 - 100 - shake(k)[0], at[1] + 12 - 100 - shake(k)[1]))
    assert tracker.camera_moves
    assert len(reported) > 20
    assert np.abs(reported).max() < 4


def test_tracks_go_to_the_picture_with_all_that_they_hold() -> None:
    pose: Array = motion.shifted(5.0, -2.0)
    groups = Groups(
        np.array([3]), (np.array([1, 2]),), np.array([[20.0, 30.0]]), np.zeros((1, 2)), np.zeros((1, 2, 2)),
        np.array([2.0]), (np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 9.0]]),),
    )  # fmt: skip
    event = GroupEvent("merge", 1, 1, 1, (-1, -1), (3,), (1, 2), (7.0, 8.0))
    tracks = Tracks(
        1, 0.0, "image", "person", np.array([1]), np.array([3]), np.array([[20.0, 30.0]]), np.ones((1, 2)),
        np.zeros((1, 4, 4)), np.array([[10.0, 10.0, 4.0, 8.0]]), np.ones(1), groups, (event,),
    )  # fmt: skip
    found = motion.in_picture(tracks, pose)
    assert found.pos.tolist() == [[15.0, 32.0]]
    assert found.box is not None
    assert found.box.tolist() == [[5.0, 12.0, 4.0, 8.0]]
    assert found.vel.tolist() == [[1.0, 1.0]]
    assert found.groups is not None
    assert found.groups.pos.tolist() == [[15.0, 32.0]]
    assert found.groups.hull[0].tolist() == [[-5.0, 2.0], [4.0, 2.0], [4.0, 11.0]]
    assert found.events[0].pos == (2.0, 10.0)
    doubled = motion.boxes_after(np.diag([2.0, 2.0, 1.0]), np.array([[10.0, 10.0, 4.0, 8.0]]))
    assert doubled.tolist() == [[20.0, 20.0, 8.0, 16.0]]
