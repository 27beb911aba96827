"""`scene_like`: a scenario like a recording, from detections alone or with labels."""

from dataclasses import replace

import numpy as np
import pytest

from scenarios import load
from scenarios.errors import InputError
from sim.sequence import simulate
from sim.types import Sequence
from tracking.fitting.detection_matching import match_sequence
from tracking.fitting.scene_like import scene_like
from tracking.fitting.sensor import fit_matched

SETTINGS = ("camera.fps=5", "camera.tilt_deg=25", "duration=30", "sensor.detect_prob=0.8", "sensor.clutter_rate=0.4")


def recording(*more: str, seed: int = 20_000) -> Sequence:
    """A street whose camera nobody knows."""
    made = simulate(load("street", set=(*SETTINGS, *more)), seed, streams=())
    return replace(made, camera=None, scene=None)


def heights(sequence: Sequence) -> np.ndarray:
    truth = sequence.truth
    return np.quantile(truth.box[truth.truncation < 0.5, 3], (0.1, 0.5, 0.9))


@pytest.fixture(scope="module")
def street() -> Sequence:
    return recording()


@pytest.mark.parametrize("labels", [False, True])
def test_camera_people_and_detector_are_like_those_of_the_recording(street: Sequence, labels: bool) -> None:
    found = scene_like(street if labels else replace(street, load_truth=None), labels=labels)
    camera, made = found.scenario.camera, simulate(found.scenario, 0, streams=())
    assert camera.fps == 5
    assert camera.image == (640, 480)
    assert camera.tilt_deg == pytest.approx(25, abs=8)
    assert np.abs(np.log(heights(made) / heights(street))).max() < np.log(1.35)
    real = (street.truth.truncation < 0.5).sum() / street.truth.length
    seen = (made.truth.truncation < 0.5).sum() / made.truth.length
    assert seen == pytest.approx(real, rel=0.5)
    labelled = fit_matched([match_sequence(street)])
    assert found.scenario.sensor.detect_prob == pytest.approx(labelled.detect_prob, abs=0.0 if labels else 0.15)


def test_people_who_are_not_found_are_counted_by_simulated_detections(monkeypatch: pytest.MonkeyPatch) -> None:
    hard = recording("sensor.detect_prob=0.55", "sensor.clutter_rate=1.0", seed=20_002)
    real, found = len(hard.truth.id) / hard.truth.length, scene_like(hard).people
    monkeypatch.setattr("tracking.fitting.scene_like._unseen", lambda *given: 1.0)
    alone = scene_like(hard).people
    assert alone < found
    assert abs(found - real) < abs(alone - real)


def test_a_crowd_twice_as_dense_gives_about_twice_the_people() -> None:
    few, many = (
        scene_like(recording(f"group.up.repeat={n}", f"group.down.repeat={n}", seed=20_001)).people for n in (6, 14)
    )
    assert 1.5 < many / few < 3.5


def test_a_wrong_frame_rate_is_doubted(street: Sequence) -> None:
    with pytest.warns(UserWarning, match=r"ways? at \d\.\d m/s: are 25 frames/s right\? \(--fps says otherwise\)"):
        found = scene_like(replace(street, fps=25.0))
    assert max(group.speed for group in found.scenario.group) > 4.0


def test_labels_without_detections_do_not_measure_the_detector(street: Sequence) -> None:
    frames = [replace(frame, detections=None) for frame in street.without_pictures()]
    bare = replace(street, has_detections=False, frames=lambda: iter(frames), bare=None)
    found = scene_like(bare, labels=True)
    assert found.text() == replace(found, measured=True).text() + " by the default detector, as there are no detections"


def test_its_text_is_a_scenario_file(street: Sequence, tmp_path) -> None:
    found = scene_like(street)
    (tmp_path / "like.toml").write_text(found.to_toml())
    again = load(tmp_path / "like.toml")
    assert again.model_copy(update={"name": "scenario"}) == found.scenario


@pytest.mark.parametrize(
    ("made", "got"),
    [
        (lambda s: replace(s, has_detections=False, frames=lambda: iter(()), bare=None), "no detected boxes"),
        (lambda s: simulate(load("merge", set=("camera.fps=5", "duration=1")), 20_000, streams=()), "people seen for"),
    ],
)
def test_a_recording_that_shows_too_little_is_one_clear_line(street: Sequence, made, got: str) -> None:
    with pytest.raises(InputError, match=got):
        scene_like(made(street))
