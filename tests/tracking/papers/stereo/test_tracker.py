"""Groups of points in space: grouping by spheres, association by velocity, merging, splitting, lost pictures."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.stereo.density import HALF, in_image
from scenarios.errors import InputError
from sim.scene.camera import project
from sim.types import Context, Frame, Groups, Tracks
from tests.reference_polygons import contains
from tests.sim.scene.test_camera_stereo import rig
from tracking.detect.features import SpacePoints
from tracking.papers.stereo import space_group
from tracking.papers.stereo.config import StereoConfig
from tracking.papers.stereo.group_life import overlap, pooled, separation, sphere_groups
from tracking.papers.stereo.picture_points import stereo_camera
from tracking.papers.stereo.space_group import VEL, Measurement
from tracking.papers.stereo.tracker import Stereo

FPS = 30.0
PICTURE = np.zeros((4, 4, 3), np.uint8)
PLACE = Measurement()


def scripted(steps, config: StereoConfig | None = None, camera=None):
    """The tracks that the tracker makes of points that stand in for features; None is a lost picture."""
    camera = camera or rig(40.0, focal=1000.0, baseline=0.5)
    tracker = Stereo(config)
    tracker.reset(Context(FPS, 30.0, camera=camera), 0)
    given = iter(steps)
    tracker.measurement, tracker.plane = Measurement(camera), "space"
    tracker.pictures = SimpleNamespace(
        config=tracker.config, camera=camera, points=lambda *_: next(given),
        features=SimpleNamespace(forget=lambda: next(given)),
    )  # fmt: skip
    tracks = []
    for k, points in enumerate(steps):
        image = None if points is None else PICTURE
        tracks.append(tracker.step(Frame(k + 1, k / FPS, image, image), None))
    return tracker, tracks


def walkers(seed: int, count: int, start, velocity, frames: int, first: int = 1, sd: float = 0.25, keep: bool = True):
    """Features of one group, (pos, vel, id) in each frame; without `keep` they have new ids in each frame."""
    r = np.random.default_rng(seed)
    offset = sd * r.standard_normal((count, 3)) * [1, 1, 1.5]
    velocity = np.asarray(velocity, float)
    for k in range(frames):
        pos = np.asarray(start) + offset + velocity * k / FPS + 0.02 * r.standard_normal((count, 3))
        vel = velocity + 0.1 * r.standard_normal((count, 3))
        yield pos, vel, np.arange(first, first + count) + (0 if keep else 1000 * k)


def together(*groups) -> list[SpacePoints]:
    made = []
    for parts in zip(*groups, strict=True):
        pos, vel, id = (np.concatenate([p[a] for p in parts]) for a in range(3))
        cov = np.repeat(4e-4 * np.eye(3)[None], len(pos), 0)
        made.append(SpacePoints(id, pos, cov, vel, 25 * cov))
    return made


def kinds(tracks) -> list[str]:
    return [e.kind for t in tracks for e in t.events]


@pytest.mark.parametrize("radius", [0.5, 1.0])
def test_spheres_overlap_up_to_two_radii(radius: float) -> None:
    pos = np.array([[0.0, 0, 0], [2 * radius, 0, 0], [2 * radius, 0, 2 * radius], [9, 9, 9]])
    assert sphere_groups(pos, radius, 1).tolist() == [0, 0, 0, 1]
    pos[1, 0] += 1e-9
    assert sphere_groups(pos, radius, 1).tolist() == [0, 1, 1, 2]
    assert sphere_groups(pos, radius, 2).tolist() == [-1, 0, 0, -1]
    assert sphere_groups(np.zeros((0, 3)), radius, 1).shape == (0,)


def test_two_points_do_not_update_a_group() -> None:
    steps = together(walkers(0, 12, [1, 5, 1], [1, 0, 0], 30))
    tracker, _ = scripted(steps)
    before = tracker.groups[0]
    expected = (tracker.motion.Phi @ before.ekf.x, tracker.motion.Phi @ before.ekf.P @ tracker.motion.Phi.T)
    for count, same in ((2, True), (3, False)):
        again, _ = scripted([*steps, steps[-1].at(np.arange(count))])
        assert np.array_equal(again.groups[0].ekf.x, expected[0]) == same
        assert np.array_equal(again.groups[0].ekf.P, expected[1] + tracker.motion.Q) == same


def test_a_lost_picture_is_a_prediction() -> None:
    steps = together(walkers(0, 12, [1, 5, 1], [1, 0, 0], 30))
    tracker, tracks = scripted([*steps, None])
    x = scripted(steps)[0].groups[0].ekf.x
    assert np.array_equal(tracker.groups[0].ekf.x, tracker.motion.Phi @ x)
    assert [len(t.id) for t in tracks[-2:]] == [1, 0]


def test_a_group_is_found_with_its_place_and_velocity() -> None:
    tracker, tracks = scripted(together(walkers(3, 20, [1, 5, 1], [1, 0.5, 0], 60)))
    assert kinds(tracks) == ["enter"]
    last = tracks[-1]
    assert last.plane == "space"
    assert last.pos.shape == (1, 3)
    assert last.vel[0] == pytest.approx([1, 0.5, 0], abs=0.1)
    assert tracker.groups[0].count == 20


def test_hidden_legs_do_not_lift_a_group() -> None:
    """Features from the feet to 1.7 m; then those below 0.9 m are hidden."""
    r = np.random.default_rng(0)
    pos = np.array([1.0, 5, 0]) + np.column_stack([0.1 * r.standard_normal((60, 2)), r.uniform(0.0, 1.7, 60)])
    whole = together([(pos, np.zeros((60, 3)), np.arange(60))] * 60)
    above = [points.at(points.pos[:, 2] > 0.9) for points in whole]
    for offset, low, high in ((0.65, 0.8, 1.0), (0.0, 1.2, 1.4)):
        _, tracks = scripted([*whole, *above * 2], StereoConfig(top_offset=offset))
        assert tracks[59].pos[0, 2] == pytest.approx(0.87, abs=0.1)
        assert low < tracks[-1].pos[0, 2] < high


@pytest.mark.parametrize(("away", "hidden", "owner"), [(0.9, 0, 0), (1.4, 0, -1), (1.4, 40, 0)])
def test_a_point_in_no_region_belongs_to_nobody(away: float, hidden: int, owner: int) -> None:
    """Its sphere overlaps those of the group's points, and its velocity is the group's (eq. 8). The region of a hidden
    group grows, with `hidden`, the number of frames."""
    (step,) = together(walkers(0, 12, [1, 5, 1], [0, 0, 0], 1))
    config = StereoConfig(point_covariance=False, radius=0.8)
    motion = space_group.motion_model(config, 1 / FPS)
    group = space_group.newborn(step, PLACE, motion, 0.0)
    for _ in range(hidden):
        space_group.predict(group, motion)
    cov = 4e-4 * np.eye(3)[None]
    point = SpacePoints(np.array([99]), group.pos[None] + [away, 0, 0], cov, group.ekf.x[None, VEL, 0], 25 * cov)
    assert sphere_groups(np.concatenate([step.pos, point.pos]), config.radius, 1).tolist() == [0] * 13
    assert space_group.associated([group], point, config).tolist() == [owner]


def crossing(seed: int, **params: object) -> bool:
    """Whether both of two groups that walk through each other have their ids afterwards."""
    frames = 100
    a = walkers(seed, 20, [-1.5, 5.0, 1], [1.0, 0, 0], frames, keep=False)
    b = walkers(seed + 100, 20, [1.8, 5.0, 1], [-1.0, 0, 0], frames, first=500, keep=False)
    _, tracks = scripted(together(a, b), StereoConfig.from_dict(params))
    last = dict(zip(tracks[-1].id.tolist(), tracks[-1].pos[:, 0].tolist(), strict=True))
    return kinds(tracks) == ["enter", "enter"] and len(last) == 2 and last[1] > 1 and last[2] < -1


def test_velocity_keeps_crossing_groups_apart() -> None:
    kept = sum(crossing(seed) for seed in range(4))
    without = sum(crossing(seed, velocity_weight=0.0) for seed in range(4))
    assert kept == 4
    assert without < 3


def test_groups_of_one_velocity_merge_and_opposite_ones_never() -> None:
    a = walkers(0, 15, [-2.2, 5, 1], [0.5, 0.5, 0], 120)
    b = walkers(1, 25, [2.2, 5, 1], [-0.5, 0.5, 0], 120, first=100)
    meet = together(a, b)
    still = together(walkers(0, 15, [-0.2, 7, 1], [0, 0.5, 0], 60), walkers(1, 25, [0.2, 7, 1], [0, 0.5, 0], 60, 100))
    tracker, tracks = scripted([*meet, *still])
    assert "merge" in kinds(tracks)
    event = next(e for t in tracks for e in t.events if e.kind == "merge")
    assert event.before == (1, 2)
    assert event.after == (2,), "the group with more points keeps its id"
    assert len(tracker.groups) == 1
    for y in (5.0, 5.3, 5.6):
        a = walkers(4, 20, [-1.5, 5.0, 1], [1.0, 0, 0], 100)
        b = walkers(5, 20, [1.8, y, 1], [-1.0, 0, 0], 100, first=100)
        assert "merge" not in kinds(scripted(together(a, b))[1])


@pytest.mark.parametrize("distance", [0.0, 0.1, 0.5, 1.0, 2.0, 4.0])
@pytest.mark.parametrize("direction", [0.0, 0.8, 1.6])
def test_regions_of_opposite_groups_overlap_at_no_distance(distance: float, direction: float) -> None:
    """Walkers in space at 0.9 m/s, by eq. 13; of the same velocity they overlap when they are near."""
    config, r = StereoConfig(), np.random.default_rng(3)
    along, motion = np.array([np.cos(direction), np.sin(direction), 0.0]), space_group.motion_model(config, 1 / FPS)

    def group(at: float, speed: float):
        pos = np.array([at, 5.0, 1.0]) + 0.25 * r.standard_normal((15, 3))
        vel = speed * along + 0.1 * r.standard_normal((15, 3))
        (step,) = together([(pos, vel, np.arange(15))])
        return space_group.newborn(step, PLACE, motion, 0.0)

    assert not overlap(group(0.0, 0.9), group(distance, -0.9), config.merge_gate)
    assert overlap(group(0.0, 0.9), group(distance, 0.9), config.merge_gate) == (distance < 1.5)


def test_a_hidden_group_merges_with_nobody() -> None:
    """The covariance P of its state grows, but its region is that of its spread."""
    a, b = ([x, 5, 1] for x in (0, 2.4))
    seen = together(walkers(0, 15, a, [0, 0.5, 0], 60, sd=0.15), walkers(1, 15, b, [0, 0.5, 0], 60, first=100, sd=0.15))
    hidden = together(walkers(0, 15, [0, 6, 1], [0, 0.5, 0], 43, sd=0.15))
    tracker, tracks = scripted([*seen, *hidden], StereoConfig(merge_gate=14.0))
    assert kinds(tracks) == ["enter", "enter"]
    one, other = tracker.groups
    d = (other.ekf.x - one.ekf.x)[:, 0]
    assert separation(d, one.spread + one.ekf.P, other.spread + other.ekf.P) < 14.0


def test_a_merged_group_has_the_moments_of_all_points() -> None:
    r = np.random.default_rng(0)
    parts = [r.standard_normal((n, 6)) + shift for n, shift in ((10, 0.0), (30, 1.0), (5, -2.0))]
    X, S = pooled(
        np.stack([p.mean(0) for p in parts]), np.stack([np.cov(p.T, bias=True) for p in parts]), np.array([10, 30, 5.0])
    )
    every = np.concatenate(parts)
    assert pytest.approx(every.mean(0)) == X
    assert pytest.approx(np.cov(every.T, bias=True)) == S


def test_a_group_whose_points_part_splits() -> None:
    a = walkers(0, 20, [0.0, 5, 1], [0.8, 0, 0], 150)
    b = walkers(1, 12, [-0.1, 5, 1], [-0.8, 0, 0], 150, first=100)
    _, tracks = scripted(together(a, b), StereoConfig(velocity_weight=0.0))
    event = next(e for t in tracks for e in t.events if e.kind == "split")
    assert event.before == (1,)
    assert event.after == (1, 2)
    assert len(tracks[-1].id) == 2
    last = dict(zip(tracks[-1].id.tolist(), tracks[-1].pos[:, 0].tolist(), strict=True))
    assert last[1] > 2, "the part with more points keeps the id"
    assert "split" not in kinds(scripted(together(walkers(0, 20, [0, 5, 1], [0.8, 0, 0], 150)))[1])


def beside(gap: float, frames: int) -> list[SpacePoints]:
    """Two points of one velocity that are `gap` m apart after 1 s beside each other."""
    near = walkers(0, 1, [0, 5, 0], [0, 1, 0], frames, sd=0.0), walkers(1, 1, [0.5, 5, 0], [0, 1, 0], frames, 100, 0.0)
    made = together(*near)
    for points in made[round(FPS) :]:
        points.pos[1, 0] += gap - 0.5
    return made


@pytest.mark.parametrize(("gap", "parts"), [(1.6, 1), (1.9, 2)])
def test_parts_that_would_merge_at_once_do_not_split(gap: float, parts: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Points are linked up to 1.5 m, and the regions of two points of one velocity overlap up to 1.7 m."""
    monkeypatch.setattr("tracking.papers.stereo.tracker.LEAST_FEATURES", 1)
    tracker, _ = scripted(beside(gap, 90), StereoConfig(radius=0.75, group_points=1))
    assert len(tracker.groups) == parts
    assert tracker.groups[0].first_seen == 0.0
    if parts == 1:
        assert tracker.groups[0].apart_since == pytest.approx(1.0, abs=0.1), "the clock runs on"


def test_a_group_that_is_gone_is_deleted() -> None:
    steps = together(walkers(0, 12, [1, 5, 1], [1, 0, 0], 30))
    tracker, tracks = scripted([*steps, *[SpacePoints.none()] * 60])
    assert kinds(tracks) == ["enter", "leave"]
    assert tracker.groups == []


@pytest.mark.parametrize("camera", [None, rig(40.0, baseline=0.0), rig(40.0).replace(radial=0.1)])
def test_a_camera_that_is_no_pair_is_refused(camera) -> None:
    with pytest.raises(InputError, match="baseline"):
        stereo_camera(camera)


def test_a_hull_in_the_image_covers_bodies_from_their_feet_to_their_heads() -> None:
    camera, square = rig(30.0), np.array([[0.5, 5.5], [1.5, 5.5], [1.5, 6.5], [0.5, 6.5]])
    pos, one = np.array([[1.0, 6.0, 1.4]]), np.array([7])
    groups = Groups(one, (np.zeros(0, int),), pos, 0 * pos, np.eye(2)[None], np.array([np.nan]), (square,))
    made = in_image(
        Tracks(1, 0.0, "space", "group", one, one, pos, 0 * pos, np.eye(6)[None], None, np.ones(1), groups, ()), camera
    )
    assert made.plane == "image"
    (hull,) = made.groups.hull
    for height, inside in ((-HALF, True), (HALF, True), (-HALF - 0.8, False), (HALF + 0.8, False)):
        uv = project(camera, np.array([[1.0, 6.0, 1.4 + height]]))[0]
        assert contains(hull, uv).tolist() == [inside], height
    corners = np.column_stack([square, np.full(4, 1.4)])
    assert contains(hull, project(camera, corners)[0], 0.01).all()
    assert made.pos[0] == pytest.approx(hull.mean(0))
    assert made.groups.id.tolist() == [7]
