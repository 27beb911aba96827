"""Who is whose detection, in small scenes by hand; correlations of errors over time come back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.special import ndtr
from scipy.stats import multivariate_normal

from scenarios.loading.resolve import load
from scenarios.schema.sensor import Memory
from sim.detector.draws import correlated_normals
from sim.geometry import boxes
from sim.sequence import simulate
from sim.types import Detections, Truth
from tests.hand_made import with_rows
from tests.recordings import mot_folder
from tracking.fitting import detection_matching as matching
from tracking.fitting.error_correlation import bivariate_normal_cdf, correlations, fit_memory, miss_correlations
from tracking.fitting.error_statistics import error_statistics, miss_runs
from tracking.fitting.false_alarms import alarm_tracks
from tracking.recordings.source import open_source


def truth_of(boxes: dict[int, list[list[float] | None]]) -> Truth:
    """People by id with a box (or None) in each frame, 10 frames per second."""
    rows = sorted((f, i, *b) for i, some in boxes.items() for f, b in enumerate(some, 1) if b is not None)
    a = np.array(rows, dtype=float)
    length = max(len(some) for some in boxes.values())
    frame, id = a[:, 0].astype(np.int64), a[:, 1].astype(np.int64)
    return Truth("hand", 10.0, length, 40.0, frame, id, np.full(len(a), -1), None, None, a[:, 2:], np.ones(len(a)))


def found(*frames: list[list[float]]) -> list[Detections]:
    made = []
    for k, rows in enumerate(frames, 1):
        box = np.array(rows, dtype=float).reshape(-1, 4)
        pos = box[:, :2] + box[:, 2:] / 2
        made.append(Detections(k, (k - 1) / 10, "image", pos, None, box, np.full(len(box), 0.5)))
    return made


HERE, THERE = [100.0, 100.0, 40.0, 100.0], [300.0, 100.0, 40.0, 100.0]
SIZE = (640, 480)


def test_overlaps_by_hand() -> None:
    a, b = np.array([[0.0, 0.0, 10.0, 10.0]]), np.array([[5.0, 5.0, 10.0, 10.0], [20.0, 0.0, 5.0, 5.0], [0, 0, 10, 10]])
    assert boxes.box_intersections(a, b).tolist() == [25.0, 0.0, 100.0]
    assert boxes.box_iou(a, b) == pytest.approx(np.array([25 / 175, 0.0, 1.0]))


def test_hits_misses_and_false_alarms() -> None:
    truth = truth_of({1: [HERE, HERE, None], 2: [THERE, THERE, THERE]})
    m = matching.match_detections(truth, found([HERE], [THERE, [500.0, 300.0, 40.0, 100.0]], []), SIZE)
    assert m.hit.tolist() == [True, False, False, True, False]  # frames 1 (1, 2), 2 (1, 2), 3 (2)
    assert m.owner.tolist() == [0, 3, -1]
    assert miss_runs(m).tolist() == [1, 1, 1]


@pytest.mark.filterwarnings("ignore:.*rows of class 7 are left out")
def test_what_motchallenge_leaves_out_is_no_false_alarm(tmp_path: Path) -> None:
    person, static, other = "1,1,100,100,40,100,1,1,1", "1,2,300,100,40,100,1,7,1", "1,3,500,100,40,100,0,3,1"
    boxes = [f"1,-1,{x},100,40,100,0.9" for x in (100, 300, 500, 10)]
    ini = "name=x\nframeRate=10\nseqLength=1\nimWidth=640\nimHeight=480\n"
    m = matching.match_sequence(
        open_source(mot_folder(tmp_path, "\n".join([person, static, other]), "\n".join(boxes), ini))[0]
    )
    assert m.box[:, 0].tolist() == [100.0, 10.0]
    assert m.false.tolist() == [False, True]
    assert m.match.tolist() == [0]


def alarmed(*frames: list[list[float]]) -> matching.MatchedRecording:
    return matching.match_detections(
        truth_of({1: [HERE] * len(frames), 2: [THERE] * len(frames)}), found(*frames), SIZE
    )


def test_alarms_are_linked_over_pauses_and_know_whom_they_are_at() -> None:
    part, far = [105.0, 105.0, 20.0, 30.0], [500.0, 300.0, 40.0, 100.0]
    chains = alarm_tracks(alarmed([HERE, part], [HERE, part, far], [HERE], [HERE, part], *[[HERE]] * 8, [HERE, part]))
    assert [c.frame.tolist() for c in chains] == [[1, 2, 4], [2], [13]]
    assert [c.person for c in chains] == [1, -1, 1]


def test_statistics_by_hand() -> None:
    m = alarmed([HERE, THERE], [HERE], [HERE], [HERE, THERE, [500.0, 300.0, 40.0, 100.0]])
    said = error_statistics([m])
    assert said["missed"] == pytest.approx(0.25)
    assert said["misses: mean run, s"] == pytest.approx(0.2)
    assert said["false alarms per frame"] == pytest.approx(0.25)
    assert said["false alarms: at people"] == 0.0
    assert said["overlap, 50% quantile"] == pytest.approx(1.0)


def test_detections_in_frames_without_labels_are_no_false_alarms() -> None:
    """Labels in every 5th frame of 10 frames/s: the profile is that of these frames, 2 a second."""
    scene = simulate(load("street", set=["sensor.clutter_rate=1"]), 30_000, streams=())
    dense, found = scene.truth, [f.detections for f in scene.without_pictures() if f.detections is not None]
    kept = (dense.frame - 1) % 5 == 0
    sparse = with_rows(dense, kept, visible_box=None, labelled=np.zeros(dense.length, bool))
    got = matching.match_sequence(replace(scene, load_truth=lambda: sparse))
    anew = sparse.replace(frame=(sparse.frame - 1) // 5 + 1, fps=2.0, length=dense.length // 5)
    told = [d.replace(index=k) for k, d in enumerate(found[::5], 1)]
    expected = matching.match_detections(anew, told, scene.image_size, scene.camera)
    assert (got.truth.fps, got.truth.length) == (2.0, dense.length // 5)
    assert got.match.tolist() == expected.match.tolist()
    assert got.owner.tolist() == expected.owner.tolist()
    assert 0.5 < got.false.sum() / got.truth.length < 1.5


@pytest.mark.parametrize("step", [1, 5])
def test_detections_of_other_frames_are_told(step: int) -> None:
    scene = simulate(load("street"), 30_000, streams=())
    some = with_rows(scene.truth, scene.truth.frame % step == 0, visible_box=None)
    late = some.replace(frame=some.frame + step, length=scene.length + step, labelled=None)
    with pytest.warns(UserWarning, match=rf"with \+{step} on their frame numbers the detections have"):
        matching.match_sequence(replace(scene, load_truth=lambda: late))


def people(count: int = 30, frames: int = 300) -> Truth:
    frame = np.repeat(np.arange(1, frames + 1), count)
    id = np.tile(np.arange(1, count + 1), frames)
    n = len(frame)
    return Truth("x", 10.0, frames, 40.0, frame, id, np.full(n, -1), None, None, np.ones((n, 4)), np.ones(n))


def drawn(truth: Truth, parts: list[Memory]) -> np.ndarray:
    z = np.empty((len(truth.id), 1))
    for one in np.unique(truth.id):
        fresh = np.random.default_rng(int(one)).standard_normal((truth.length, 1))
        z[truth.id == one] = correlated_normals(fresh, parts, 1, truth.fps, 5, int(one), 0)
    return z


@pytest.mark.parametrize("rho", [-0.4, 0.0, 0.5, 0.99])
def test_two_normals_together(rho: float) -> None:
    a, b = np.array([-1.0, 0.3, 2.0, 0.0]), np.array([-0.5, 0.3, -1.0, 0.0])
    law = multivariate_normal([0.0, 0.0], [[1.0, rho], [rho, 1.0]])
    assert bivariate_normal_cdf(a, b, rho) == pytest.approx(law.cdf(np.stack([a, b], axis=1)), abs=2e-4)


PARTS = [Memory(share=0.4, time=0.3), Memory(share=0.4, time=4.0)]


def wanted(lag: np.ndarray) -> np.ndarray:
    return sum(m.share * np.exp(-lag / m.time) for m in PARTS)  # type: ignore[return-value]


def test_correlations_of_errors_and_of_what_is_behind_misses() -> None:
    truth = people(240)
    z = drawn(truth, PARTS)
    seen = correlations(truth, z, np.ones(len(z), bool))
    assert seen[0, 0] == pytest.approx(0.1)
    assert seen[:, 1] == pytest.approx(wanted(seen[:, 0]), abs=0.08)
    p_miss = np.where(truth.id % 2 == 0, 0.15, 0.4)  # the chance differs from person to person, the memory does not
    behind = miss_correlations(truth, ndtr(z[:, 0]) < p_miss, p_miss)
    assert behind[:, 1] == pytest.approx(wanted(behind[:, 0]), abs=0.12)


def test_exponentials_come_back() -> None:
    lag = np.geomspace(0.1, 10.0, 14)
    found = fit_memory([np.column_stack([lag, wanted(lag), np.full(14, 1000.0)])])
    at = np.array([0.1, 0.5, 2.0, 8.0])
    assert sum(m.share * np.exp(-at / m.time) for m in found) == pytest.approx(wanted(at), abs=0.01)
    assert sum(m.share for m in found) <= 1.0
