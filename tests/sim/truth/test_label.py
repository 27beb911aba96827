"""Labels of a motion: rows, groups with hulls, means and extents, on the ground and in the image."""

import numpy as np
import pytest

from sim.geometry.hull_kernels import convex_hull
from sim.scene.body import Ellipsoids, contour, ellipsoids, outlines, person_boxes
from sim.scene.camera import project
from sim.truth.group_hulls import box_groups, groups_over_time
from sim.truth.label import POINTS, bodies, hulls, image_groups, image_velocities, label
from sim.types import Array, Motion
from tests.reference_polygons import area, footprint_hull
from tests.reference_sense import above, crowd, pinhole, walkers


def some(n: int, seed: int) -> Ellipsoids:
    r = np.random.default_rng(seed)
    pos3 = np.column_stack([r.uniform([6, 3], [9, 6], (n, 2)), np.zeros(n)])
    return ellipsoids(pos3, r.uniform(0, 6, n), r.uniform(1.5, 1.95, n))


def inside(hull: Array, points: Array) -> Array:
    """How far points lie to the left of every side of a counter-clockwise polygon."""
    side = np.roll(hull, -1, axis=0) - hull
    side = side / np.linalg.norm(side, axis=1, keepdims=True)
    d = points[None] - hull[:, None]
    return (side[:, None, 0] * d[..., 1] - side[:, None, 1] * d[..., 0]).min(axis=0)


@pytest.mark.parametrize("camera", [pinhole(), above(20)])
@pytest.mark.parametrize("seed", range(5))
def test_hulls_are_the_hulls_of_dense_silhouettes(camera, seed: int) -> None:  # type: ignore[no-untyped-def]
    shapes = some(9, seed)
    edge = contour(outlines(camera, shapes), points=400)
    for hull, members in zip(
        hulls(outlines(camera, shapes), np.array([0, 2, 5])), ([0, 1], [2, 3, 4], [5, 6, 7, 8]), strict=True
    ):
        exact = convex_hull(edge[members].reshape(-1, 2))
        assert inside(exact, hull).min() > -0.02  # points of it, to the 400-gons' own error
        assert inside(hull, exact).min() > -0.01 * np.ptp(exact, axis=0).max()
        assert area(hull) == pytest.approx(area(exact), rel=0.02)
        same = convex_hull(contour(outlines(camera, shapes), POINTS)[members].reshape(-1, 2))
        assert np.array_equal(hull, same)


def test_groups_keep_ids_and_members_and_get_places_in_the_image() -> None:
    motion, camera = crowd(0, people=6, frames=4), pinhole()
    truth = bodies(motion, camera)
    grouped = np.array([-1, 3, 3, -1, 8, 8, 8])[truth.id]
    truth = truth.replace(group=np.where(truth.frame % 2 == 1, grouped, -1))
    pos3 = np.column_stack([truth.pos, np.zeros(len(truth.id))])  # type: ignore[list-item]
    shapes = ellipsoids(pos3, truth.heading, truth.height)  # type: ignore[arg-type]
    found = image_groups(truth, camera, shapes)
    assert [g.id.tolist() for g in found] == [[3, 8], [], [3, 8], []]
    assert found[2].members[1].tolist() == [4, 5, 6]
    box = truth.at(3).box
    middle = box[:, :2] + box[:, 2:] / 2
    assert found[2].pos == pytest.approx(np.stack([middle[:2].mean(axis=0), middle[3:].mean(axis=0)]))
    assert found[2].extent[1] == pytest.approx(np.cov(middle[3:].T, bias=True))
    assert found[2].size.tolist() == [2, 3]
    assert inside(found[2].hull[1], middle[3:]).min() > 0


@pytest.mark.parametrize("camera", [pinhole(), above(20)])
def test_image_velocities_are_differences_of_places(camera) -> None:  # type: ignore[no-untyped-def]
    r = np.random.default_rng(0)
    middle, vel = r.uniform([5, 3, 0.8], [11, 8, 0.9], (20, 3)), r.normal(size=(20, 2))
    later = middle + 1e-4 * np.column_stack([vel, np.zeros(20)])
    slow = (project(camera, later)[0] - project(camera, middle)[0]) / 1e-4
    assert image_velocities(camera, middle, vel) == pytest.approx(slow, rel=1e-2, abs=0.05)


def meeting(frames: int = 120) -> Motion:
    """A pair walks towards somebody who stands, and stands beside them from frame 41 on; a stranger is far off."""
    motion = walkers([[4, 5], [4.7, 5], [9, 5], [2, 9]], [[1, 0], [1, 0], [0, 0], [0, 0]], frames=frames)
    pos, vel = motion.pos.copy(), motion.vel.copy()
    pos[40:, :2] = pos[40, :2]
    vel[40:, :2] = 0
    intent = np.tile([0, 0, 2, 3], (frames, 1))
    intent[20:, 2] = 0
    return motion.replace(pos=pos, vel=vel, intent=intent, heading=np.zeros_like(motion.heading))


def test_rows_are_sorted_and_say_what_the_motion_says() -> None:
    motion = crowd(2, people=5, frames=20, present=np.random.default_rng(0).random((20, 5)) < 0.7)
    truth = bodies(motion, pinhole())
    assert (np.lexsort((truth.id, truth.frame)) == np.arange(len(truth.id))).all()
    assert len(truth.id) == motion.present.sum()
    assert truth.box is not None
    assert (truth.pos == motion.pos[truth.frame - 1, truth.id - 1]).all()
    assert (truth.height == motion.height[truth.id - 1]).all()
    pos3 = np.column_stack([truth.pos, np.zeros(len(truth.id))])
    assert truth.box == pytest.approx(person_boxes(pinhole(), pos3, truth.heading, truth.height))  # type: ignore[arg-type]
    now = truth.at(7)
    assert now.id.tolist() == (np.flatnonzero(motion.present[6]) + 1).tolist()


def test_groups_come_from_the_measurement_on_the_ground_and_in_the_image() -> None:
    motion, camera = meeting(), pinhole()
    truth = label(motion, camera)
    assert truth.events is not None
    assert truth.groups is not None
    assert truth.groups_px is not None
    assert truth.labelled.all()
    merged = [e for e in truth.events if e.kind in ("merge", "form")]
    assert len(merged) == 1
    assert merged[0].emitted is None
    assert merged[0].members == (1, 2, 3)
    first, last = truth.at(1), truth.at(truth.length)
    assert first.group.tolist() == [first.group[0], first.group[0], -1, -1]
    assert last.group.tolist() == [last.group[0]] * 3 + [-1]
    assert last.groups.members[0].tolist() == last.groups_px.members[0].tolist() == [1, 2, 3]
    middles = last.box[:3, :2] + last.box[:3, 2:] / 2
    assert last.groups_px.pos[0] == pytest.approx(middles.mean(axis=0))


def test_a_sequence_without_groups_has_truth() -> None:
    from scenarios.loading.resolve import load
    from sim.sequence import simulate

    alone = [f"group.{name}.size=1" for name in ("passers", "stop", "north", "south", "west", "east")]
    truth = simulate(load("crowd", [*alone, "duration=3"]), 1).truth
    assert all(len(g.id) == 0 for g in truth.groups_px)


def frame_groups(id, group, pos, vel):
    return groups_over_time(np.zeros(len(id), np.int64), id, group, pos, vel, 0, 1)[0]


def test_groups_of_a_frame():
    id, group = np.array([9, 4, 7, 5, 8]), np.array([2, 1, 2, -1, 3])
    pos, vel = np.array([[0.0, 0], [5, 5], [1, 0], [9, 9], [3, 3]]), np.arange(10.0).reshape(5, 2)
    g = frame_groups(id, group, pos, vel)
    assert g.id.tolist() == [2], "groups of one are none"
    assert [m.tolist() for m in g.members] == [[7, 9]]
    assert (g.pos.tolist(), g.vel.tolist(), g.size.tolist()) == ([[0.5, 0]], [[2, 3]], [2])
    assert g.extent.tolist() == [[[0.25, 0], [0, 0]]]
    np.testing.assert_allclose(g.hull[0], footprint_hull(pos[[0, 2]]))


def test_groups_over_time_are_those_of_each_frame():
    r = np.random.default_rng(1)
    frame = np.sort(r.integers(2, 9, 60))
    frame = frame[frame != 5]
    id = np.arange(len(frame))
    group, pos, vel = r.integers(-1, 3, len(frame)), r.normal(size=(len(frame), 2)), r.normal(size=(len(frame), 2))
    many = groups_over_time(frame, id, group, pos, vel, 1, 10)
    for t, g in enumerate(many, start=1):
        one = frame_groups(*(x[frame == t] for x in (id, group, pos, vel)))
        assert g.id.tolist() == one.id.tolist()
        assert [m.tolist() for m in g.members] == [m.tolist() for m in one.members]
        for name in ("pos", "vel", "extent", "size"):
            np.testing.assert_array_equal(getattr(g, name), getattr(one, name))
        assert all(np.array_equal(a, b) for a, b in zip(g.hull, one.hull, strict=True))


def test_groups_in_the_image():
    frame, id, group = np.zeros(3, np.int64), np.array([1, 2, 3]), np.array([1, 1, -1])
    pos = np.array([[10.0, 10], [30, 10], [90, 90]])
    box = np.array([[5.0, 0, 10, 20], [25, 0, 10, 20], [85, 80, 10, 20]])
    (g,) = box_groups(frame, id, group, pos, pos * 0, box, 0, 1)
    assert g.hull[0].tolist() == [[5, 0], [35, 0], [35, 20], [5, 20]]
    (g,) = groups_over_time(frame, id, group, pos, pos * 0, 0, 1, px_per_m=20.0)
    assert g.hull[0][:, 0].min() == pytest.approx(5)
    assert g.pos.tolist() == [[20, 10]]
