from typing import Any

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.schema.sensor import Hide, Sensor
from sim.detector.box_noise import box_errors
from sim.detector.clutter import false_alarm_counts
from sim.detector.sense import detection_probability, sense
from sim.scene.camera import foot_points
from sim.truth.label import bodies
from sim.types import Detections, Truth
from tests.hand_made import with_rows
from tests.reference_sense import above, crowd, pinhole

SIZE = (640, 480)
CAMERA = pinhole(at=(8.0, -8.0, 9.0))
PERFECT: dict[str, Any] = {
    "detect_prob": 1.0, "clutter_rate": 0.0, "box_noise": {"scale": 0.0}, "noise_m": 0.0, "box": "amodal",
    "occlusion_power": 0.0, "min_visibility": 0.0, "small_px": 0.0,
}  # fmt: skip


def seen(seed: int = 0, people: int = 12, frames: int = 200, **changes: Any) -> Truth:
    """People who stand scattered before the usual camera."""
    motion = crowd(seed, people, frames)
    motion = motion.replace(pos=np.broadcast_to(motion.pos[:1], motion.pos.shape))
    return bodies(motion, CAMERA).replace(**changes)


def perfect(**changes: Any) -> Sensor:
    return Sensor.model_validate(PERFECT | changes)


def everything(found: list[Detections], name: str) -> np.ndarray:
    return np.concatenate([getattr(d, name) for d in found])


def same(a: Detections, b: Detections) -> bool:
    boxes = (a.box is None and b.box is None) or np.array_equal(a.box, b.box)  # type: ignore[arg-type]
    return np.array_equal(a.pos, b.pos) and boxes and np.array_equal(a.score, b.score)


@pytest.mark.parametrize("camera", [pinhole(), above()])
def test_a_perfect_sensor_gives_the_truth(camera: Any) -> None:
    truth = bodies(crowd(1), camera)
    for d in sense(truth, perfect(), 3, camera, SIZE):
        now = truth.at(d.index)
        assert d.plane == "ground"
        assert d.t == now.t
        order = np.lexsort(d.pos.T), np.lexsort(now.pos.T)
        assert np.array_equal(d.pos[order[0]], now.pos[order[1]])
        assert np.array_equal(d.box[order[0]], now.box[order[1]])
        assert (d.score == 1).all()


def test_boxes_alone_are_found_in_the_image_and_points_alone_on_the_ground() -> None:
    truth = seen(frames=5)
    boxes_only = truth.replace(pos=None, vel=None, visible_box=None)
    for d in sense(boxes_only, perfect(clutter_rate=3.0), 3, None, SIZE):
        assert d.plane == "image"
        assert d.pos == pytest.approx(d.box[:, :2] + d.box[:, 2:] / 2)
    points_only = truth.replace(box=None, visible_box=None)
    for d in sense(points_only, perfect(clutter_rate=3.0, noise_m=0.1), 3):
        assert d.plane == "ground"
        assert d.box is None
        assert np.isfinite(d.pos).all()


def test_every_frame_has_its_detections_and_nobody_is_no_error() -> None:
    truth = seen(frames=6, people=3)
    assert [d.index for d in sense(truth, Sensor(), 0, pinhole(), SIZE)] == [1, 2, 3, 4, 5, 6]
    keep = np.zeros(len(truth.id), bool)
    nobody = Truth("x", 10.0, 6, 40.0, truth.frame[keep], truth.id[keep], truth.group[keep], np.zeros((0, 2)),
                   np.zeros((0, 2)), np.zeros((0, 4)), np.zeros(0), visible_box=np.zeros((0, 4)))  # fmt: skip
    assert [len(d.pos) for d in sense(nobody, perfect(), 0, pinhole(), SIZE)] == [0] * 6
    assert sum(len(d.pos) for d in sense(nobody, perfect(clutter_rate=2.0), 0, pinhole(), SIZE)) > 0
    assert len(sense(nobody, perfect(clutter_rate=2.0), 0)) == 6


@pytest.mark.parametrize("p", [0.5, 0.9])
def test_misses_are_as_frequent_as_asked(p: float) -> None:
    truth = seen(people=25, frames=400)
    n = len(everything(sense(truth, perfect(detect_prob=p), 1), "score"))
    assert n / len(truth.id) == pytest.approx(p, abs=4 * np.sqrt(p * (1 - p) / len(truth.id)))


@pytest.mark.parametrize("rate", [0.3, 5.0, 60.0])
def test_clutter_is_poisson(rate: float) -> None:
    n = false_alarm_counts(np.full(20_000, rate), seed=1)
    assert n.mean() == pytest.approx(rate, abs=4 * np.sqrt(rate / 20_000))
    assert n.var() == pytest.approx(rate, rel=0.06)
    assert (false_alarm_counts(np.full(20_000, rate * 1.2), seed=1) >= n).all()
    assert (false_alarm_counts(np.zeros(10), seed=1) == 0).all()


def test_noise_has_the_sd_that_was_asked_for() -> None:
    truth = seen(people=20, frames=300)
    boxes = {"across": (0, 0.04), "foot": (0, 0.05), "top": (0, 0.03), "width": (0, 0.1)}
    exact, noisy = sense(truth, perfect(), 1), sense(truth, perfect(noise_m=0.2, box_noise=boxes), 1)
    move = everything(noisy, "pos") - everything(exact, "pos")
    assert move.std(axis=0) == pytest.approx([0.2, 0.2], rel=0.05)
    assert move.mean(axis=0) == pytest.approx([0, 0], abs=0.02)
    errors = box_errors(everything(noisy, "box"), everything(exact, "box"))
    assert errors.std(axis=0) == pytest.approx([0.04, 0.05, 0.03, 0.1], rel=0.05)
    assert np.abs(np.corrcoef(np.column_stack([errors, move]).T) - np.eye(6)).max() < 0.06
    assert (everything(sense(truth, perfect(box_noise={"scale": 20.0}), 1), "box")[:, 2:] >= 1).all()


def test_sweeps_share_their_draws() -> None:
    truth = seen(people=8, frames=60)
    few, many = (sense(truth, perfect(detect_prob=p, noise_m=0.1, box_noise={}), 1) for p in (0.6, 0.9))
    for a, b in zip(few, many, strict=True):
        assert {tuple(row) for row in a.pos} <= {tuple(row) for row in b.pos}
        assert {tuple(row) for row in a.box} <= {tuple(row) for row in b.box}  # type: ignore[union-attr]
    rare, often = (sense(truth, perfect(clutter_rate=c, noise_m=0.1), 1, pinhole(), SIZE) for c in (0.5, 3.0))
    for a, b in zip(rare, often, strict=True):
        assert {tuple(row) for row in a.pos} <= {tuple(row) for row in b.pos}


def test_a_person_or_a_frame_more_moves_nobody_else() -> None:
    sensor = Sensor(detect_prob=0.8, clutter_rate=1.0, persistence=0.5)
    truth = seen(people=8, frames=60)
    fewer = truth.id != 3
    without, shorter = with_rows(truth, fewer), with_rows(truth, truth.frame <= 30, length=30)
    whole = sense(truth, sensor, 5, pinhole(), SIZE)
    for a, b in zip(whole, sense(shorter, sensor, 5, pinhole(), SIZE), strict=False):
        assert same(a, b)
    for a, b in zip(whole, sense(without, sensor, 5, pinhole(), SIZE), strict=True):
        assert {tuple(r) for r in b.pos} <= {tuple(r) for r in a.pos}
        assert len(a.pos) - len(b.pos) in (0, 1)


def test_who_is_hidden_is_missed() -> None:
    truth = seen(people=2, frames=400)
    half = truth.replace(visibility=np.where(truth.id == 1, 0.5, 1.0))
    share = {
        power: len(everything(sense(half, perfect(occlusion_power=power), 1), "score")) for power in (0.0, 1.0, 2.0)
    }
    assert share[0.0] == 800
    assert share[1.0] == pytest.approx(600, abs=40)
    assert share[2.0] == pytest.approx(500, abs=40)
    assert len(everything(sense(half, perfect(min_visibility=0.6), 1), "score")) == 400


def test_small_people_are_missed() -> None:
    truth = seen(people=1, frames=1)
    tall = float(truth.box[0, 3])
    for small, p in ((tall, 0.5), (2 * tall, 0.25), (tall / 2, 1.0), (tall / 3, 1.0)):
        assert detection_probability(truth, perfect(small_px=small)) == pytest.approx([p])
    from_above = bodies(crowd(0), above())
    assert (detection_probability(from_above, perfect(small_px=12.0), above()) == 1).all()


def test_visible_boxes_follow_the_visible_part() -> None:
    truth = seen(people=2, frames=3)
    part = truth.box * np.array([1, 1, 1, 0.5])
    cut = truth.replace(visible_box=part)
    found = sense(cut, perfect(box="visible"), 1)
    assert np.sort(everything(found, "box")[:, 3]) == pytest.approx(np.sort(part[:, 3]))
    assert {tuple(r) for r in everything(found, "pos")} == {tuple(r) for r in truth.pos}  # type: ignore[union-attr]
    assert np.sort(everything(sense(cut, perfect(), 1), "box")[:, 3]) == pytest.approx(np.sort(truth.box[:, 3]))
    gone = truth.replace(visible_box=np.full_like(truth.box, np.nan))
    assert np.isfinite(everything(sense(gone, perfect(box="visible"), 1), "box")).all()


def hidden_from_below(truth: Truth, share: float) -> Truth:
    """The same people, of each of whom the lower `share` of the box is hidden."""
    part = truth.box * np.array([1, 1, 1, 1 - share])
    return truth.replace(visible_box=part if share else truth.box, visibility=np.full(len(truth.id), 1 - share))


@pytest.mark.parametrize("z", [0.0, 0.8])
def test_points_follow_the_foot_of_the_visible_part(z: float) -> None:
    truth = seen(people=6, frames=3)
    truth = hidden_from_below(truth.replace(z=np.full(len(truth.id), z)), 0.4)
    rays_end = foot_points(truth.visible_box, truth.z, CAMERA), foot_points(truth.box, truth.z, CAMERA)  # type: ignore[arg-type]
    wanted = truth.pos + rays_end[0] - rays_end[1]
    found = everything(sense(truth, perfect(box="visible"), 1, CAMERA), "pos")
    assert np.sort(found, axis=0) == pytest.approx(np.sort(wanted, axis=0))
    whole = everything(sense(truth, perfect(), 1, CAMERA), "pos")  # amodal boxes: nothing is hidden from the detector
    assert {tuple(r) for r in whole} == {tuple(r) for r in truth.pos}  # type: ignore[union-attr]


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.9])
def test_misses_persist(rho: float) -> None:
    truth = seen(people=20, frames=800)
    found = sense(truth, perfect(detect_prob=0.7, persistence=rho), 1)
    here = np.zeros((800, 20))
    where = {tuple(p): k for k, p in enumerate(truth.at(1).pos)}  # type: ignore[arg-type]
    for d in found:
        here[d.index - 1, [where[tuple(p)] for p in d.pos]] = 1
    assert here.mean() == pytest.approx(0.7, abs=0.03 if rho < 0.8 else 0.06)
    a, b = here[1:].ravel(), here[:-1].ravel()
    assert np.corrcoef(a, b)[0, 1] == pytest.approx(rho, abs=0.05)


def test_hiding() -> None:
    truth = seen(people=4, frames=30)
    all_gone = sense(truth, perfect(hide=(Hide(start=1.0, end=2.0),)), 1)
    assert [len(d.pos) for d in all_gone] == [4] * 10 + [0] * 10 + [4] * 10
    two = perfect(hide=(Hide(start=1.0, end=2.0, group="a"),))
    assert [len(d.pos) for d in sense(truth, two, 1, people={"a": (1, 3)})] == [4] * 10 + [2] * 10 + [4] * 10
    with pytest.raises(InputError, match=r"sensor\.hide\.0\.group"):
        sense(truth, two, 1)


@pytest.mark.parametrize("camera", [pinhole(), pinhole(10, 0, (8, -6, 2)), pinhole(90, 0, (8, 5, 9)), above()])
def test_false_alarms_look_like_people(camera: Any) -> None:
    truth = bodies(crowd(0, frames=300), camera)
    nobody = perfect(detect_prob=0.0, clutter_rate=4.0)
    found = sense(truth, nobody, 1, camera, SIZE)
    box, pos, score = (everything(found, name) for name in ("box", "pos", "score"))
    assert len(box) == pytest.approx(1200, abs=150)
    assert np.isfinite(box).all()
    assert np.isfinite(pos).all()
    assert (box[:, 2:] > 0).all()
    across = (box[:, 0] + box[:, 2] / 2) / 640
    assert np.histogram(across, 4, (0, 1))[0] == pytest.approx(np.full(4, len(box) / 4), rel=0.2)
    assert score.mean() == pytest.approx(0.525, abs=0.03)
    assert (score >= 0.1).all()
    assert (score <= 0.95).all()
    assert len(np.unique(box, axis=0)) == len(box)
    clipped = everything(
        sense(truth, perfect(detect_prob=0.0, clutter_rate=4.0, box="visible"), 1, camera, SIZE), "box"
    )
    assert clipped.min() >= 0
    assert (clipped[:, :2] + clipped[:, 2:]).max() <= 640
