"""False alarms that stay: their number, their lives, where they are."""

from typing import Any

import numpy as np
import pytest

from scenarios.loading.resolve import load
from scenarios.schema.sensor import FalseAlarms, Sensor
from sim.detector.sense import sense
from sim.scene.camera import foot_points, project
from sim.sequence import simulate
from sim.truth.label import bodies
from sim.types import Detections, Truth
from tests.reference_sense import above, crowd, pinhole
from tests.sim.detector.test_sense import CAMERA, SIZE, everything, seen


def alarms(truth: Truth, rate: float = 2.0, seed: int = 1, camera: Any = CAMERA, **model: Any) -> list[Detections]:
    sensor = Sensor(
        detect_prob=0.0, clutter_rate=rate, box="amodal", false_alarms=FalseAlarms(**model), false_scores=(0.2, 0.4)
    )
    return sense(truth, sensor, seed, camera, SIZE)


@pytest.mark.parametrize("model", [{"life": 1.0}, {"life": 2.0, "seen": 0.5}, {"life": 1.0, "near": 1.0}])
def test_as_many_as_asked_for_whatever_their_life(model: dict[str, float]) -> None:
    truth = seen(people=2, frames=3000)
    n = np.array([len(d.pos) for d in alarms(truth, **model)])
    slow = 1.0 + 2.0 * 10.0 * model["life"]  # effective samples are fewer by about this
    assert n.mean() == pytest.approx(2.0, abs=4 * np.sqrt(2.0 * slow / 3000))
    assert n.var() == pytest.approx(2.0, rel=0.25)
    wanted = model.get("seen", 1.0) * np.exp(-1 / (10 * model["life"]))
    assert np.corrcoef(n[1:], n[:-1])[0, 1] == pytest.approx(wanted, abs=0.08)


def test_those_beside_people_keep_their_place_and_size() -> None:
    truth = seen(frames=400)
    model = {"life": 3.0, "near": 1.0, "across": (0.5, 0.0), "foot": (-0.2, 0.0), "near_height": (-0.7, 0.0)}
    box = everything(alarms(truth, **model, aspect=(-1.0, 0.0)), "box")
    first = truth.box[truth.rows(1)]
    tall = first[:, 3] * np.exp(-0.7)
    middle, foot = first[:, 0] + first[:, 2] / 2 + 0.5 * first[:, 3], first[:, 1] + 0.8 * first[:, 3]
    wanted = np.column_stack([middle - tall * np.exp(-1.0) / 2, foot - tall, tall * np.exp(-1.0), tall])
    assert np.abs(box[:, None] - wanted).max(axis=2).min(axis=1).max() < 1e-6


@pytest.mark.parametrize("near", [0.0, 1.0])
def test_points_are_where_people_with_these_boxes_stand(near: float) -> None:
    """Also from straight above, where a person stands in the middle of the box."""
    for camera in (CAMERA, above()):
        truth = bodies(crowd(0, 12, 60), camera)
        found = alarms(truth, camera=camera, near=near)
        box, pos = everything(found, "box"), everything(found, "pos")
        assert len(pos) > 50
        assert pos == pytest.approx(foot_points(box, np.zeros(len(box)), camera))


@pytest.mark.parametrize("camera", [pinhole(), pinhole(10, 0, (8, -6, 2)), above(), None])
def test_everything_is_finite_whatever_is_known(camera: Any) -> None:
    truth = bodies(crowd(0, frames=100), camera or pinhole())
    model = {"life": 1.0, "near": 0.5, "drift": 0.3, "jitter": 0.05}
    for known in (truth, truth.replace(pos=None, vel=None), truth.replace(box=None, visible_box=None)):
        for d in alarms(known, camera=camera, **model):
            assert np.isfinite(d.pos).all()
            assert (d.box is None) == (known.box is None)
            assert d.box is None or (np.isfinite(d.box).all() and (d.box[:, 2:] > 0).all())
            assert ((d.score >= 0.2) & (d.score <= 0.4)).all()
    nobody = truth.replace(**{f: getattr(truth, f)[:0] for f in ("frame", "id", "group", "pos", "vel", "box",
                              "visibility", "visible_box", "z")})  # fmt: skip
    assert (sum(len(d.pos) for d in alarms(nobody, camera=camera, **model)) > 0) == (camera is not None)


def test_false_alarms_of_a_moving_camera_stand_still_in_the_world() -> None:
    alarms = "{near=0.0, life=60.0, drift=0.0, jitter=0.0, seen=1.0}"
    settings = ["duration=3", "sensor.detect_prob=0", "sensor.clutter_rate=4", f"sensor.false_alarms={alarms}"]
    settings += ["sensor.box=amodal", "camera.motion={kind='pan', deg_per_s=4}"]
    sequence = simulate(load("cross", settings), 90_001, streams=())
    assert sequence.load_cameras is not None
    cameras, found = sequence.load_cameras(), [f.detections for f in sequence]
    assert all(d is not None and len(d.pos) > 0 for d in found)
    for d, camera in zip(found, cameras, strict=True):
        foot = d.box[:, :2] + d.box[:, 2:] * [0.5, 1.0]
        assert project(camera, np.column_stack([d.pos, np.zeros(len(d.pos))]))[0] == pytest.approx(foot, abs=1e-6)
    first, last = ({tuple(p) for p in np.round(d.pos, 6).tolist()} for d in (found[0], found[-1]))
    assert first & last
