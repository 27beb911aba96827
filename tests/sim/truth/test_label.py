import numpy as np
import pytest

from sim.scene.body import person_boxes
from sim.truth.label import bodies, label
from sim.types import Motion, Scene, Stairs
from tests.reference_sense import crowd, pinhole, walkers


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
    assert truth.pos is not None
    assert truth.height is not None
    assert truth.box is not None
    assert (truth.pos == motion.pos[truth.frame - 1, truth.id - 1]).all()
    assert (truth.height == motion.height[truth.id - 1]).all()
    pos3 = np.column_stack([truth.pos, np.zeros(len(truth.id))])
    assert truth.box == pytest.approx(person_boxes(pinhole(), pos3, truth.heading, truth.height))  # type: ignore[arg-type]
    now = truth.at(7)
    assert now.id.tolist() == (np.flatnonzero(motion.present[6]) + 1).tolist()


def test_people_on_stairs_stand_on_them() -> None:
    stairs = (Stairs(np.array([4.0, 5.0]), np.array([8.0, 5.0]), 3.0, 1.6, 8, 4.0),)
    scene = Scene(np.array([16.0, 10.0]), stairs=stairs)
    still = walkers([[9.0, 5.0], [9.0, 8.0]], [[0, 0], [0, 0]], frames=1, scene=scene)
    truth = bodies(still, pinhole())
    assert truth.z == pytest.approx([1.6, 0.0])
    level = bodies(still.replace(scene=Scene(np.array([16.0, 10.0]))), pinhole())
    assert truth.box is not None
    assert level.box is not None
    assert truth.box[0, 1] < level.box[0, 1] - 20  # higher up in the image
    assert truth.box[1] == pytest.approx(level.box[1])


def test_without_a_camera_there_are_no_boxes() -> None:
    truth = bodies(crowd(0), None)
    assert truth.box is None
    assert truth.visible_box is None
    assert (truth.visibility == 1).all()
    assert np.isnan(truth.px_per_m)


def test_nobody_is_no_error() -> None:
    truth = bodies(walkers([[8, 5]], [[0, 0]], present=np.zeros((40, 1), bool)), pinhole())
    assert len(truth.id) == 0
    assert truth.box is not None
    assert truth.box.shape == (0, 4)


def test_groups_come_from_the_measurement_on_the_ground_and_in_the_image() -> None:
    pytest.importorskip("sim.truth.merge_split_events", exc_type=ImportError)
    pytest.importorskip("sim.truth.crossing_events", exc_type=ImportError)
    motion, camera = meeting(), pinhole()
    truth = label(motion, camera)
    assert truth.events is not None
    assert truth.groups is not None
    assert truth.groups_px is not None
    assert truth.labelled is not None
    assert truth.labelled.all()
    merged = [e for e in truth.events if e.kind in ("merge", "form")]
    assert len(merged) == 1
    assert merged[0].emitted is None
    assert merged[0].members == (1, 2, 3)
    first, last = truth.at(1), truth.at(truth.length)
    assert first.group.tolist() == [first.group[0], first.group[0], -1, -1]
    assert last.group.tolist() == [last.group[0]] * 3 + [-1]
    assert last.groups is not None
    assert last.groups_px is not None
    assert last.groups.members[0].tolist() == last.groups_px.members[0].tolist() == [1, 2, 3]
    assert last.box is not None
    middles = last.box[:3, :2] + last.box[:3, 2:] / 2
    assert last.groups_px.pos[0] == pytest.approx(middles.mean(axis=0))


def test_the_orders_times_change_nothing() -> None:
    pytest.importorskip("sim.truth.merge_split_events", exc_type=ImportError)
    pytest.importorskip("sim.truth.crossing_events", exc_type=ImportError)
    from sim.types import Order

    ordered = meeting().replace(orders=(Order("m", "merge", 21, ((1, 2), (3,)), ((1, 2, 3),)),))
    a, b = label(ordered, None), label(meeting(), None)
    assert [(e.kind, e.start, e.members) for e in a.events or ()] == [
        (e.kind, e.start, e.members) for e in b.events or ()
    ]


def test_a_sequence_without_groups_has_truth() -> None:
    from scenarios.loading.resolve import load
    from sim.sequence import simulate

    alone = [f"group.{name}.size=1" for name in ("passers", "stop", "north", "south", "west", "east")]
    truth = simulate(load("crowd", [*alone, "duration=3"]), 1).truth
    assert truth is not None
    assert truth.groups_px is not None
    assert all(len(g.id) == 0 for g in truth.groups_px)
