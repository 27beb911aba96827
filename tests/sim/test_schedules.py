"""Values that change during a scene: known values at their edges, and detections and cameras that follow them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from scenarios.loading.resolve import load
from scenarios.schema.schedule import Schedule
from scenarios.schema.sensor import FalseAlarms, Sensor
from sim.crowd.world import run
from sim.detector.sense import sense
from sim.scene.camera import project
from sim.scene.camera_motion import MovingCamera, place_view
from sim.schedules import at_rows, looked_at, values_at
from sim.sequence import observe
from sim.types import Array, Detections
from tests.sim.detector.test_sense import CAMERA, SIZE, everything, perfect, same, seen

FPS = 10.0  # of `seen`


def schedule(at: list[float], value: list[float], ramp: float = 0.0) -> Schedule:
    return Schedule(at=tuple(at), value=tuple(value), ramp=ramp)


def table(at: list[float], value: list[float], ramp: float = 0.0) -> dict[str, Any]:
    return schedule(at, value, ramp).model_dump()


def test_values_at_edges() -> None:
    steps = schedule([0, 20, 40], [0.95, 0.6, 0.9])
    t = np.array([-3.0, 0.0, 19.999, 20.0, 39.999, 40.0, 1e6])
    assert values_at(steps, t).tolist() == [0.95, 0.95, 0.95, 0.6, 0.6, 0.9, 0.9]
    assert values_at(0.3, t).tolist() == [0.3] * 7
    assert values_at(2, t[:0]).shape == values_at(steps, t[:0]).shape == (0,)


def test_values_in_ramps() -> None:
    ramps = schedule([0, 1, 5, 9], [1, 0.5, 0, 2], ramp=4)
    t = np.array([0.0, 1.0, 2.0, 3.0, 5.0, 7.0, 9.0, 10.0, 13.0, 14.0])
    assert values_at(ramps, t) == pytest.approx([1, 1, 0.875, 0.75, 0.5, 0.25, 0, 0.5, 2, 2])


def test_values_are_those_that_were_given_to_the_last_bit() -> None:
    r = np.random.default_rng(1)
    for _ in range(200):
        value = [*np.round(r.uniform(0, 1, 3), 1), 0.0]
        for ramp in (0.0, 0.7):
            found = values_at(schedule([0, 1, 2, 3], value, ramp), np.arange(0, 5, 0.01))
            assert found[[0, 199, 299, 499]].tolist() == value
            assert min(value) <= found.min()
            assert found.max() <= max(value) + 1e-12


def test_frame_times_meet_the_times_of_a_schedule_at_every_rate() -> None:
    """A change at a frame's time counts in this frame, whatever the rounding of the time."""
    truth = seen(people=1, frames=1)
    for fps in (7, 10, 12, 15, 24, 25, 29.97, 30, 50):
        rows = truth.replace(frame=np.arange(1, 201), fps=float(fps))
        for frame in range(2, 201, 11):
            assert at_rows(schedule([0, (frame - 1) / fps], [0, 1]), rows).sum() == 201 - frame


def looks(every: Any, length: int = 12, fps: float = 10.0) -> list[int]:
    return (np.flatnonzero(looked_at(every, length, fps)) + 1).tolist()


def test_looks() -> None:
    assert looks(None) == looks(1.0) == list(range(1, 13))
    assert looks(5.0) == [1, 6, 11]
    assert looks(2.5) == [1, 4, 6, 9, 11]
    assert looks(1000.0) == [1]
    assert looks(schedule([0, 0.3, 0.8], [1, 2, 1])) == [1, 2, 3, 4, 6, 8, 10, 11, 12]
    assert looked_at(3.0, 0, 10.0).shape == (0,)
    for step in (3, 7, 10, 49):
        assert looks(float(step), 20 * step) == list(range(1, 20 * step, step)), "thirds and sevenths sum up"


def phases(found: list[Detections], *edges: int) -> list[list[Detections]]:
    return [found[a:b] for a, b in zip((0, *edges), (*edges, None), strict=True)]


def test_the_detected_share_follows() -> None:
    truth = seen(people=25, frames=600)
    found = sense(truth, perfect(detect_prob=table([0, 20, 40], [0.9, 0.3, 0.6], 5)), 1)
    shares = [len(everything(part, "score")) / 25 / len(part) for part in phases(found, 200, 250, 400, 450)]
    assert shares == pytest.approx([0.9, 0.6, 0.3, 0.45, 0.6], abs=0.05)


def test_false_alarms_follow() -> None:
    truth = seen(people=2, frames=3000)
    sensor = perfect(detect_prob=0.0, clutter_rate=table([0, 100, 200], [0.5, 4, 0]))
    found = sense(truth, sensor, 1, CAMERA, SIZE)
    counts = [np.array([len(d.pos) for d in part]) for part in phases(found, 1000, 2000)]
    assert [n.mean() for n in counts] == pytest.approx([0.5, 4, 0], abs=0.25)
    assert counts[1].var() == pytest.approx(4, rel=0.15)
    assert not counts[2].any()


@pytest.mark.parametrize("life", [0.0, 2.0])
def test_false_alarms_that_last_follow_as_old_ones_end(life: float) -> None:
    truth = seen(people=2, frames=1200)
    model = FalseAlarms(life=life, near=0.5)
    sensor = Sensor(detect_prob=0.0, clutter_rate=table([0, 40, 80], [0.5, 4, 0]), false_alarms=model, box="amodal")
    counts = [np.array([len(d.pos) for d in p]) for p in phases(sense(truth, sensor, 1, CAMERA, SIZE), 400, 800)]
    settled = round(5 * life * FPS)
    assert [n[settled:].mean() for n in counts] == pytest.approx([0.5, 4, 0], abs=1.0 if life else 0.3)
    if life:
        assert counts[1][:10].mean() < 2.5, "new ones are born one by one"
        assert counts[2][:5].mean() > 1, "old ones live on"
    assert not counts[2][round(12 * life * FPS) :].any()


def spread(found: list[Detections], exact: list[Detections], name: str) -> list[float]:
    """Standard deviations per phase of 20 s, of the first column."""
    both = zip(phases(found, 200), phases(exact, 200), strict=True)
    return [float((everything(a, name) - everything(b, name))[:, 0].std()) for a, b in both]


def test_noise_follows() -> None:
    truth = seen(people=20, frames=400)
    exact = sense(truth, perfect(), 1)
    noisy = sense(truth, perfect(noise_m=table([0, 20], [0.0, 0.2])), 1)
    assert spread(noisy, exact, "pos") == pytest.approx([0, 0.2], rel=0.05)
    across = {"across": (0, 0.05), "width": (0, 0), "foot": (0, 0), "top": (0, 0), "floor_px": 0}
    one, changed = (sense(truth, perfect(box_noise={**across, "scale": s}), 1) for s in (1.0, table([0, 20], [0.5, 3])))
    plain = spread(one, exact, "box")
    assert spread(changed, exact, "box") == pytest.approx([0.5 * plain[0], 3 * plain[1]])


def test_looks_leave_out_whole_frames_and_change_no_other() -> None:
    truth = seen(people=6, frames=200)
    plain, rare = (
        sense(truth, Sensor(clutter_rate=2.0, persistence=0.3, false_alarms=alarms, every=every), 1, CAMERA, SIZE)
        for alarms in (FalseAlarms(life=1.0),)
        for every in (None, schedule([0, 10], [2, 5]))
    )
    look = looked_at(schedule([0, 10], [2, 5]), 200, FPS)
    assert look[:100].sum() == 50
    assert look[100:].sum() == 20
    for a, b, seen_then in zip(plain, rare, look.tolist(), strict=True):
        assert same(a, b) if seen_then else len(b.pos) == len(b.score) == 0
        assert b.box is not None


CHANGES = {
    "sensor.detect_prob": (0.95, 0.4), "sensor.clutter_rate": (0.3, 4), "sensor.noise_m": (0.05, 0.5),
    "sensor.box_noise.scale": (1, 4), "sensor.every": (1, 3),
}  # fmt: skip


SHORT = ("camera.fps=5", "duration=6")


@pytest.mark.parametrize("alarms", [[], ["sensor.false_alarms={life=2, near=0.5}"]], ids=["", "lasting alarms"])
def test_before_the_first_change_detections_are_those_without_one(alarms: list[str]) -> None:
    motion = run(load("cross", SHORT), 30_000)

    def frames(*settings: str) -> list[Detections]:
        made = observe(load("cross", [*SHORT, *alarms, *settings]), motion)
        return [f.detections for f in made.without_pictures()]  # type: ignore[misc]

    plain = frames()
    for key, (before, after) in CHANGES.items():
        changed = frames(f"{key}={{at=[0, 3], value=[{before}, {after}]}}")
        equal = [same(a, b) for a, b in zip(plain, changed, strict=True)]
        assert all(equal[:15]), key
        assert not all(equal[15:]), key


def pointing(moving: MovingCamera, t: Array) -> Array:
    """Where the middle of the picture at rest is in the pictures at times t, px from the middle."""
    ahead = moving.rest.position + 10 * moving.rest.rotation[2]
    return np.array([project(moving.at(float(each)), ahead[None])[0][0] for each in t]) - moving.rest.centre_px


def shaken(px: str, roll: float = 0.0) -> MovingCamera:
    motion = f"camera.motion={{kind='shake', px={px}, roll_deg={roll}}}"
    scenario = load("cross", ["camera.image=[160, 120]", "camera.focal_px=125", "duration=3", motion])
    made = place_view(scenario.camera, run(scenario, 90_001))
    assert isinstance(made, MovingCamera)
    return made


GROWS = "{at=[0, 50], value=[2, 10]}"


def test_a_shake_grows() -> None:
    small, large, grows, none = map(shaken, ("2.0", "10.0", GROWS, "{at=[0, 50], value=[0, 0]}"))
    first, second = np.arange(0, 50, 0.25), np.arange(50, 100, 0.25)
    assert pointing(grows, first) == pytest.approx(pointing(small, first), abs=1e-9)
    assert pointing(grows, second) == pytest.approx(pointing(large, second), abs=1e-9)
    assert pointing(grows, first).std() == pytest.approx(2, rel=0.15)
    assert pointing(grows, second).std() == pytest.approx(10, rel=0.15)
    assert pointing(none, first) == pytest.approx(0, abs=1e-9)


def test_the_roll_of_a_shake_is_where_the_shake_is_largest() -> None:
    grows, large = (shaken(px, 1.0) for px in (GROWS, "10.0"))
    rest = large.rest.rotation
    before, after, whole = (np.degrees(view.at(t).rotation[0] @ rest[1]) for view, t in
                            ((grows, 1.3), (grows, 51.3), (large, 51.3)))  # fmt: skip
    assert after == pytest.approx(whole)
    assert before == pytest.approx(np.degrees(large.at(1.3).rotation[0] @ rest[1]) / 5, rel=0.05)
    assert min(abs(before), abs(after)) > 0.02
