"""Round trip: detections of a known profile, fitted, give the profile back within statistical error."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import load
from scenarios.schema.sensor import BoxNoise, FalseAlarms, Memory, Sensor
from sim.detector.sense import sense
from sim.sequence import simulate
from sim.types import Detections, Frame, Sequence, Truth
from tests.hand_made import with_rows
from tracking.app.pictures.contact_sheet import choose_frames, write_sheet
from tracking.app.pictures.overlay import write_overlay
from tracking.drawing.layers import layer_of_truth
from tracking.fitting.detection_matching import MatchedRecording, match_detections, match_sequence
from tracking.fitting.error_statistics import error_statistics, simulated_detections
from tracking.fitting.false_alarms import fit_false_alarms
from tracking.fitting.sensor import fit_matched, fit_sensor

KNOWN = Sensor(
    detect_prob=0.85,
    clutter_rate=1.2,
    noise_m=0.2,
    box="amodal",
    min_visibility=0.0,
    small_px=0.0,
    by_visibility=(0.05, 0.3, 0.6, 0.9, 1.0),
    miss_memory=(Memory(share=0.7, time=0.6),),
    box_noise=BoxNoise(
        across=(0.01, 0.03), foot=(-0.02, 0.05), top=(0.03, 0.04), width=(0.1, 0.12), occluded=1.0,
        memory=(Memory(share=0.6, time=1.0),),
    ),
    points="foot",
    false_alarms=FalseAlarms(
        life=1.5, seen=0.8, near=0.4, across=(0.02, 0.04), foot=(-0.3, 0.05), near_height=(-1.1, 0.1),
        height=(0.2, 0.1), aspect=(-0.8, 0.1), drift=0.1, jitter=0.02,
    ),
    true_scores=(0.3, 0.8, 1.0),
    false_scores=(0.2, 0.3, 0.6),
)  # fmt: skip


@cache
def scenes() -> tuple[tuple[Truth, Any], ...]:
    """Three streets before a level camera that looks along them; read-only, whatever a test makes of them."""
    made = []
    for seed in range(30_000, 30_003):
        scenario = load(
            "street", set=["camera.tilt_deg=15", "camera.yaw_deg=0", "camera.image=[1280, 720]", "duration=25.0"]
        )
        sequence = simulate(scenario, seed, streams=())
        made.append((sequence.truth, sequence.camera))
    return tuple(made)


def seen(sensor: Sensor, seed: int = 0) -> list[MatchedRecording]:
    return [
        match_detections(truth, sense(truth, sensor, seed + k, camera, camera.image), camera.image, camera)
        for k, (truth, camera) in enumerate(scenes())
    ]


@cache
def fitted() -> Sensor:
    return fit_matched(seen(KNOWN))


def near(found: Any, wanted: Any, absolute: float) -> None:
    assert np.array(found) == pytest.approx(np.array(wanted), abs=absolute)


def test_misses_come_back() -> None:
    found = fitted()
    near(found.detect_prob, KNOWN.detect_prob, 0.03)
    near(found.by_visibility, KNOWN.by_visibility, 0.12)
    assert found.small_px == 0.0
    for lag in (0.1, 0.5, 1.5):
        near(correlation(found.miss_memory, lag), 0.7 * np.exp(-lag / 0.6), 0.1)


def correlation(memory: tuple[Memory, ...], lag: float) -> float:
    return sum(part.share * float(np.exp(-lag / part.time)) for part in memory)


@pytest.mark.slow
def test_noise_comes_back() -> None:
    found, known = fitted().box_noise, KNOWN.box_noise
    for name, absolute in (("across", 0.004), ("foot", 0.006), ("top", 0.006), ("width", 0.02)):
        near(getattr(found, name), getattr(known, name), absolute)
    near(found.occluded, 1.0, 0.25)
    assert found.tails <= 0.5
    for lag in (0.1, 1.0, 3.0):
        near(correlation(found.memory, lag), 0.6 * np.exp(-lag / 1.0), 0.07)
    assert fitted().box == "amodal"


@pytest.mark.slow
def test_false_alarms_come_back() -> None:
    busy = KNOWN.model_copy(update={"clutter_rate": 4.0})
    rate, found = fit_false_alarms(seen(busy, seed=50))
    alone = seen(busy.model_copy(update={"detect_prob": 0.0}), seed=50)  # the same alarms, nobody detected
    known = KNOWN.false_alarms
    near(rate, sum(len(m.box) for m in alone) / sum(m.truth.length for m in alone), 0.2)
    near(found.life, 1.5, 0.35)
    near(found.seen, 0.8, 0.08)
    near(found.near, 0.4, 0.15)  # of some 150 alarms, each seen for 0 to 60 frames; some end as their person leaves
    for name, absolute in (("across", 0.04), ("foot", 0.04), ("near_height", 0.06), ("aspect", 0.04)):
        near(getattr(found, name), getattr(known, name), absolute)
    near(found.height, known.height, 0.08)
    near(found.drift, 0.1, 0.04)
    near(found.jitter, 0.02, 0.006)


@pytest.mark.slow
def test_scores_come_back() -> None:
    found = fitted()
    near(np.array(found.true_scores)[[1, 5, 9]], (0.4, 0.8, 0.96), 0.03)
    near(np.array(found.false_scores)[[1, 5, 9]], (0.22, 0.3, 0.54), 0.06)


@pytest.mark.slow
@pytest.mark.parametrize(("points", "box"), [("own", "visible"), ("seen", "visible"), ("foot", "amodal")])
def test_points_are_told(points: Any, box: Any) -> None:
    small = BoxNoise(scale=0.3)  # with large errors of boxes people are matched with their neighbours' detections
    found = fit_matched(seen(Sensor(points=points, box=box, noise_m=0.1, min_visibility=0.0, box_noise=small))[:1])
    assert found.points == points
    near(found.noise_m, Sensor().noise_m if points == "foot" else 0.1, 0.01)


@pytest.mark.slow
def test_synthetic_errors_look_like_those_they_were_fitted_to() -> None:
    """Statistics of new draws of the fitted sensor lie among those of new draws of the true one."""
    first = seen(KNOWN)[:2]
    real = [error_statistics([simulated_detections(m, KNOWN, 100 * k) for m in first]) for k in range(1, 4)]
    made = [error_statistics([simulated_detections(m, fitted(), 100 * k) for m in first]) for k in range(1, 4)]
    for name in ("missed", "misses: mean run, s", "overlap, 50% quantile", "overlap, 10% quantile",
                 "false alarms per frame", "false alarms: at people"):  # fmt: skip
        a, b = np.array([r[name] for r in real]), np.array([m[name] for m in made])
        assert abs(a.mean() - b.mean()) < 3.5 * max(a.std(), b.std(), 0.02 * abs(a.mean())), name


def as_sequence(truth: Truth, camera: Any, sensor: Sensor, **changes: Any) -> Sequence:
    found = sense(truth, sensor, 0, camera, camera.image)
    frames = lambda: iter([Frame(d.index, d.t, detections=d) for d in found])  # noqa: E731
    made = Sequence("made", truth.fps, truth.length, frames, lambda: truth, camera.image, camera, has_detections=True)
    return replace(made, **changes)


def test_what_cannot_be_fitted_is_refused() -> None:
    truth, camera = scenes()[0]
    nothing = KNOWN.model_copy(update={"detect_prob": 0.0, "clutter_rate": 0.0})
    bad = {
        "no labelled people": as_sequence(truth, camera, KNOWN, load_truth=None),
        "no detections": as_sequence(truth, camera, KNOWN, has_detections=False),
        "labels without boxes": as_sequence(truth, camera, KNOWN, load_truth=lambda: truth.replace(box=None)),
        "no detection in any frame": as_sequence(truth, camera, nothing),
    }
    for words, sequence in bad.items():
        with pytest.raises(InputError, match=words):
            match_sequence(sequence)
    short = with_rows(truth, truth.frame <= 1, length=1)
    with pytest.raises(InputError, match="labelled people"):
        fit_sensor([as_sequence(short, camera, KNOWN)])


NONE = np.zeros(0, np.int64)
EMPTY = Truth("none", 10.0, 0, 40.0, NONE, NONE, NONE, None, None, np.zeros((0, 4)), np.zeros(0))


def test_a_recording_without_frames():
    matched = match_detections(EMPTY, [], (64, 48))
    assert fit_false_alarms([matched]) == (0.0, None)
    assert all(np.isnan(v) for v in error_statistics([matched]).values())
    assert choose_frames(layer_of_truth(EMPTY), 0, 10.0, 8) == []


def test_boxes_without_scores():
    box = np.array([[10.0, 10, 8, 20]])
    one = np.ones(1, np.int64)
    truth = Truth("one", 10.0, 1, 40.0, one, one, -one, None, None, box, np.ones(1))
    matched = match_detections(truth, [Detections(1, 0.0, "image", box[:, :2], None, box)], (64, 48))
    assert matched.score.tolist() == [1.0]


def test_pictures_of_a_sequence_without_frames(tmp_path):
    nothing = Sequence("none", 10.0, 0, lambda: iter(()), load_truth=lambda: EMPTY, has_images=True, image_size=(8, 8))
    with pytest.raises(InputError, match="no frame"):
        write_overlay(nothing, None, tmp_path / "o.mp4")
    with pytest.raises(InputError, match="no frame"):
        write_sheet(nothing, tmp_path / "s.png")
    assert not list(tmp_path.iterdir())
