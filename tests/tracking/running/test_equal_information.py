"""A tracker gets what its row of a table says, and the oracle the same, with the owners that the sensor knows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.dataset.generate import generate
from sim.detector.sense import sense_owned
from sim.scene.standing import standing_points
from sim.sequence import simulate
from sim.truth.label import bodies
from sim.types import Detections, Frame, Sequence, Tracks
from tests.tracking.running.test_run import Stranger
from tracking.oracle import named_detections, oracle
from tracking.recordings.source import open_source
from tracking.running.detection_mode import Given, as_needed, given_detections
from tracking.running.prepare import prepare
from tracking.running.run import track
from tracking.running.run_info import input_name
from tracking.running.truth_detections import from_truth
from tracking.scoring import evaluate


class OfBoxes(Stranger):
    needs = ("boxes",)


class OfBoxCentres(OfBoxes):
    """Looks at `box` alone, as trackers in the image do."""

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        assert detections is not None
        assert detections.box is not None
        found = detections.replace(plane="image", pos=detections.box[:, :2] + detections.box[:, 2:] / 2)
        return super().step(frame, found).replace(box=detections.box)


class OfPoints(Stranger):
    needs = ("points",)


def scene(noise: float = 0.0, seed: int = 30_000, **more: object) -> Sequence:
    settings = [f"sensor.noise_m={noise}", "camera.fps=5", *(f"sensor.{key}={value}" for key, value in more.items())]
    return simulate(load("crowd", settings), seed)


@pytest.mark.parametrize("kind", [OfBoxes, OfBoxCentres])
def test_the_error_of_points_does_not_reach_a_tracker_of_boxes(kind: type[Stranger], tmp_path: Path) -> None:
    runs = [track(kind, scene(noise), detections="file") for noise in (0.0, 0.1, 1.0)]
    for noise in (0.0, 1.0):
        settings = [f"sensor.noise_m={noise}", "camera.fps=5"]
        (folder,) = generate(["crowd"], [30_000], tmp_path / str(noise), set=settings, streams=())
        runs.append(track(kind, open_source(folder)[0], detections="file"))
    for other in runs[1:]:
        for a, b in zip(runs[0], other, strict=True):
            assert a.pos.tobytes() == b.pos.tobytes()
    settings = {"detect_prob": 0.9, "box_noise.scale": 1.0}
    poor = [
        track(kind, scene(), detections="truth", sensor={**settings, "noise_m": noise}, seed=3) for noise in (0.1, 1.0)
    ]
    for a, b in zip(*poor, strict=True):
        assert a.pos.tobytes() == b.pos.tobytes()
    assert input_name(runs[0].info) == "boxes (file)"


def test_positions_of_boxes_are_where_their_bodies_stand() -> None:
    sequence = scene()
    found = prepare(OfBoxes, sequence, detections="file").frames_given
    assert found is not None
    assert sequence.camera is not None
    given = [f.detections for f in found]
    for d in given:
        assert d is not None
        assert d.box is not None
        assert d.plane == "ground"
        assert np.array_equal(d.pos, standing_points(d.box, sequence.camera, sequence.scene))
    flat = Sequence(sequence.name, sequence.fps, sequence.length, sequence.frames, sequence.load_truth, (640, 480))
    for frame in prepare(OfBoxes, flat, detections="truth").frames_given or ():
        d = frame.detections
        assert d is not None
        assert d.box is not None
        assert d.plane == "image"
        assert np.array_equal(d.pos, d.box[:, :2] + d.box[:, 2:] / 2)


def test_a_box_whose_foot_shows_no_ground_is_left_out_and_its_owner_with_it() -> None:
    sequence = scene()
    camera = sequence.camera
    assert camera is not None
    given = given_detections("file", sequence, {}, 0, owned=True)
    first, *changed = given.detections
    assert first is not None
    assert first.box is not None
    box = first.box.copy()
    box[1, 1] = -1e5  # above the horizon
    kept = as_needed(type(given)([first.replace(box=box), *changed], given.owners), ("boxes",), "file", sequence)
    found = next(iter(kept.detections))
    assert found is not None
    assert kept.owners is not None
    assert given.owners is not None
    assert found.score.tolist() == np.delete(first.score, 1).tolist()
    assert kept.owners[0].tolist() == np.delete(given.owners[0], 1).tolist()


def test_a_tracker_of_points_gets_no_boxes() -> None:
    for frame in prepare(OfPoints, scene(), detections="file").frames_given or ():
        assert frame.detections is not None
        assert frame.detections.box is None
    assert track(OfPoints, scene(), detections="file").info["input"] == "points"


@pytest.mark.parametrize("stored", [False, True])
def test_the_oracle_knows_whose_the_detections_of_the_sensor_are(stored: bool, tmp_path: Path) -> None:
    sequence = scene(clutter_rate=2.0)
    scenario = load("crowd", ["sensor.clutter_rate=2.0", "sensor.noise_m=0.0", "camera.fps=5"])
    from sim.crowd.world import run

    motion = run(scenario, 30_000, 0)
    _, owners = sense_owned(bodies(motion, sequence.camera), scenario.sensor, 30_000, sequence.camera)
    if stored:
        settings = ["sensor.clutter_rate=2.0", "sensor.noise_m=0.0", "camera.fps=5"]
        (folder,) = generate(["crowd"], [30_000], tmp_path, set=settings, streams=())
        assert (folder / "gt" / "det_ids.txt").read_text().startswith("1,")
        (sequence,) = open_source(folder)
    named = named_detections(sequence, {"detections": "file", "input": "points"})
    for t, who in zip(named, owners, strict=True):
        assert np.array_equal(t.id[t.id >= 0], who[t.id >= 0])
    right = sum(int((t.id >= 0).sum()) for t in named)
    assert right > 0.95 * sum(int((who >= 0).sum()) for who in owners)
    assert oracle(sequence, {"detections": "file", "input": "points"}).info["owners"] == "known"


def test_more_clutter_leaves_the_oracle_as_it_is() -> None:
    for input in ("boxes", "points"):
        found = []
        for rate in (0.0, 2.0, 10.0):
            sequence = scene(clutter_rate=rate)
            assert sequence.truth is not None
            found.append(evaluate(sequence.truth, oracle(sequence, {"detections": "file", "input": input}))["HOTA"])
        assert found[0] == found[1] == found[2]


def test_labels_that_are_degraded_tell_whose_they_are() -> None:
    sequence = scene()
    truth = sequence.truth
    assert truth is not None
    assert truth.pos is not None
    for sensor in ({}, {"clutter_rate": 3.0, "noise_m": 0.0}):
        given = Given(*from_truth(sequence, sensor, 5))
        assert given.owners is not None
        for d, who in zip(given.detections, given.owners, strict=True):
            assert d is not None
            at = {int(i): p.tolist() for i, p in zip(truth.at(d.index).id, truth.at(d.index).pos, strict=True)}
            assert all(at[int(i)] == p.tolist() for i, p in zip(who, d.pos, strict=True) if i >= 0)
