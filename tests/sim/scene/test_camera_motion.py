"""A camera that moves: its poses at given times, and pictures and truth that follow it."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import load
from sim.crowd.world import run
from sim.scene.camera import camera_rotation, project
from sim.scene.camera_motion import MovingCamera, by_frame, cameras_of_frames, place_view, turn
from sim.sequence import observe, simulate
from sim.types import Camera

SMALL = ("camera.image=[160, 120]", "camera.focal_px=125", "duration=3")
SHAKE, PAN, DRIFT = "{kind='shake', px=4}", "{kind='pan', deg_per_s=5, sweep_deg=12}", "{kind='drift', deg_per_s=2}"
ROBOT = "{kind='robot', path=[[2, 2], [12, 2], [12, 12]], speed=2, bob=0}"
KINDS = {"shake": SHAKE, "pan": PAN, "drift": DRIFT, "robot": ROBOT}


def view(motion: str, *more: str, seed: int = 90_001) -> MovingCamera:
    scenario = load("cross", [*SMALL, f"camera.motion={motion}", *more])
    made = place_view(scenario.camera, run(scenario, seed))
    assert isinstance(made, MovingCamera)
    return made


@pytest.mark.parametrize("motion", KINDS.values(), ids=KINDS)
def test_common_times_of_two_frame_rates_have_the_same_camera(motion: str) -> None:
    placed = [] if motion == ROBOT else ["camera.height=6", "camera.position=[10, -5]", "camera.crop=true"]
    slow, fast = (cameras_of_frames(view(motion, f"camera.fps={fps}", *placed), fps, 3 * fps) for fps in (10, 30))
    for a, b in zip(slow, fast[::3], strict=True):
        assert np.array_equal(a.rotation, b.rotation)
        assert np.array_equal(a.position, b.position)


@pytest.mark.parametrize("motion", KINDS.values(), ids=KINDS)
def test_poses_are_rotations(motion: str) -> None:
    for t in (-5.0, 0.0, 1.7, 40.0):
        r = view(motion).at(t).rotation
        assert r @ r.T == pytest.approx(np.eye(3), abs=1e-12)
        assert np.linalg.det(r) == pytest.approx(1.0)


def test_a_shake_has_the_standard_deviation_and_the_band_that_it_is_given() -> None:
    moving = view("{kind='shake', px=4, roll_deg=0, band=[1, 2]}")
    ahead = moving.rest.position + 10 * moving.rest.rotation[2]
    at = np.array([project(moving.at(k / 20), ahead[None])[0][0] for k in range(4000)]) - moving.rest.centre_px
    assert at.std(axis=0) == pytest.approx([4, 4], rel=0.15)
    power = np.abs(np.fft.rfft(at[:, 0])) ** 2
    hertz = np.fft.rfftfreq(len(at), 1 / 20)
    assert power[(hertz > 0.95) & (hertz < 2.05)].sum() > 0.98 * power.sum()
    assert not np.array_equal(view("{kind='shake', px=4}", seed=90_002).at(0).rotation, view(SHAKE).at(0).rotation)


def test_a_pan_turns_left_about_the_vertical_and_back_at_its_end() -> None:
    moving = view(PAN, "camera.yaw_deg=30")
    for t, turned in ((0.0, 0.0), (1.0, 5.0), (2.4, 12.0), (3.4, 7.0), (4.8, 0.0), (-1.0, -5.0)):
        expected = camera_rotation(np.radians(40), np.radians(30 + turned))
        assert moving.at(t).rotation == pytest.approx(expected, abs=1e-12)
        assert np.array_equal(moving.at(t).position, moving.rest.position)


def test_a_drift_goes_straight_on_at_its_speed() -> None:
    moving = view(DRIFT)
    axes = [moving.at(t).rotation[2] for t in (0.0, 1.0, 2.0)]
    assert [np.degrees(np.arccos(a @ b)) for a, b in pairwise(axes)] == pytest.approx([2, 2], rel=1e-3)
    other = view(DRIFT, seed=90_002)
    assert np.abs(other.at(1).rotation - moving.at(1).rotation).max() > 1e-3


def test_a_robot_walks_its_path_and_looks_ahead() -> None:
    moving = view(ROBOT, "camera.tilt_deg=0")
    for t, place, ahead in (
        (-1.0, (2, 2), (1, 0)), (0.0, (2, 2), (1, 0)), (2.0, (6, 2), (1, 0)), (7.0, (12, 6), (0, 1)),
        (99.0, (12, 12), (0, 1)), (5.0, (12, 2), (np.sqrt(0.5), np.sqrt(0.5))),
    ):  # fmt: skip
        camera = moving.at(t)
        assert camera.position == pytest.approx([*place, 1.3])
        assert camera.rotation[2] == pytest.approx([*ahead, 0], abs=1e-9)
    bobbing = view(ROBOT.replace("bob=0", "bob=0.1"))
    heights = [bobbing.at(t).position[2] for t in np.arange(0, 5, 0.01)]
    assert (min(heights), max(heights)) == pytest.approx((1.2, 1.4), abs=1e-3)


def test_turns_go_right_then_down_then_clockwise() -> None:
    point = np.array([0.0, 0.0, 1.0])
    assert (turn(0.1, 0, 0) @ point)[0] < 0
    assert (turn(0, 0.1, 0) @ point)[1] < 0
    assert (turn(0, 0, 0.1) @ np.array([1.0, 0.0, 1.0]))[1] < 0


@pytest.mark.parametrize("motion", KINDS.values(), ids=KINDS)
def test_the_truth_shows_people_where_they_are_drawn(motion: str) -> None:
    more = ["camera.tilt_deg=5"] if motion == ROBOT else []
    scenario = load("cross", [*SMALL, f"camera.motion={motion}", *more])
    sequence = simulate(scenario, 90_001, streams=("left", "ids", "disparity"))
    assert sequence.camera is None
    assert sequence.load_cameras is not None
    truth, cameras, seen, known = sequence.truth, sequence.load_cameras(), 0, 0
    for frame in list(sequence)[::7]:
        here, camera = sequence.frame_truth(frame.index), cameras[frame.index - 1]
        rows, pixels = truth.rows(frame.index), here.pixels
        assert pixels is not None
        assert truth.visible_box is not None
        assert len(pixels.box) == len(here.id)
        shown = (pixels.visible_px > 30) & (pixels.box[:, 3] < 60)
        error = np.abs(pixels.box[shown] - truth.visible_box[rows][shown])
        assert error.max(initial=0) < 1.5
        seen += int(shown.sum())
        # The disparity at a person is that of the person's depth.
        middle = np.column_stack([here.pos, np.full(len(here.id), 0.9)])
        uv, depth = project(camera, middle)
        for k in np.flatnonzero(shown):
            u, v = np.floor(uv[k]).astype(int)
            if 0 <= u < 160 and 0 <= v < 120 and pixels.ids[v, u] == here.id[k] and np.isfinite(pixels.disparity[v, u]):
                own = camera.focal_px[0] * camera.baseline / depth[k]
                assert pixels.disparity[v, u] == pytest.approx(own, rel=0.06)
                known += 1
    assert min(seen, known) > 2


def test_ground_is_drawn_where_it_is_projected() -> None:
    """A red board on the ground moves in the pictures as its projection does."""
    box = "world.boxes=[{at=[14.5, 10, 0.05], size=[1, 1, 0.1], colour='red'}]"
    scenario = load("cross", [*SMALL, f"camera.motion={PAN}", box, "picture.noise=0", "duration=2"])
    sequence = simulate(scenario, 90_001)
    assert sequence.load_cameras is not None
    for frame, camera in list(zip(sequence, sequence.load_cameras(), strict=True))[::10]:
        b, g, r = np.moveaxis(frame.image.astype(float), 2, 0)
        v, u = np.nonzero(r - np.maximum(b, g) > 60)
        corners = np.array([[x, y, z] for x in (14, 15) for y in (9.5, 10.5) for z in (0.0, 0.1)])
        uv, _ = project(camera, corners)
        assert [u.min(), u.max() + 1] == pytest.approx([uv[:, 0].min(), uv[:, 0].max()], abs=1.5)
        assert [v.min(), v.max() + 1] == pytest.approx([uv[:, 1].min(), uv[:, 1].max()], abs=1.5)


def test_people_out_of_view_have_no_row_but_a_place_in_the_world() -> None:
    still, moving = (
        simulate(load("cross", [*SMALL, *more]), 90_001, streams=())
        for more in ([], ["camera.motion={kind='pan', deg_per_s=12}"])
    )
    a, b = still.truth, moving.truth
    assert b.truncation is not None
    assert len(b.id) < len(a.id)
    assert b.truncation.max() < 1
    everybody = {(f, i): p for f, i, p in zip(a.frame.tolist(), a.id.tolist(), a.pos.tolist(), strict=True)}
    assert all(everybody[f, i] == p for f, i, p in zip(b.frame.tolist(), b.id.tolist(), b.pos.tolist(), strict=True))
    assert all(set(members) <= set(b.id[b.rows(k + 1)]) for k, g in enumerate(b.groups) for members in g.members)


def test_rows_come_with_the_camera_of_their_frame() -> None:
    moving = view(PAN)
    frame = np.array([1, 1, 4, 9, 9, 9])
    found = list(by_frame(moving, frame, 10.0))
    assert [(r.start, r.stop) for _, r in found] == [(0, 2), (2, 3), (3, 6)]
    assert np.array_equal(found[1][0].rotation, moving.at(0.3).rotation)
    assert [(r.start, r.stop) for _, r in by_frame(moving.rest, frame, 10.0)] == [(0, 6)]
    assert [(r.start, r.stop) for _, r in by_frame(moving, frame[:0], 10.0)] == [(0, 0)]


REFUSED: dict[str, tuple[list[str], str]] = {
    "from above": (["camera.kind=top", f"camera.motion={SHAKE}"], "camera.motion: got kind top"),
    "placed": (["camera.height=3", f"camera.motion={ROBOT}"], "camera.height: got a value"),
    "sky": (["camera.tilt_deg=-30", f"camera.motion={ROBOT}"], "without ground"),
}


@pytest.mark.parametrize(("settings", "words"), REFUSED.values(), ids=REFUSED)
def test_cameras_that_cannot_move_so_are_refused(settings: list[str], words: str) -> None:
    scenario = load("cross", [*SMALL, *settings])
    with pytest.raises(InputError, match=words):
        observe(scenario, run(scenario, 90_001))


BAD: dict[str, Any] = {
    "{kind='shake', band=[5, 1]}": "highest", "{kind='robot', path=[[1, 1], [1, 1]]}": "twice",
    "{kind='fly'}": "shake", "{kind='robot', path=[[1, 1]]}": "at least 2",
}  # fmt: skip


@pytest.mark.parametrize(("motion", "words"), BAD.items(), ids=BAD)
def test_wrong_motions_are_refused_when_loaded(motion: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        load("cross", [f"camera.motion={motion}"])


def test_a_value_of_the_motion_may_be_drawn() -> None:
    drawn = load("cross", [*SMALL, "camera.motion={kind='shake', px={uniform=[2, 9]}}"])
    found = [simulate(drawn, seed, streams=()).load_cameras for seed in (90_001, 90_002)]
    assert all(cameras is not None and isinstance(cameras()[0], Camera) for cameras in found)
