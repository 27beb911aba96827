"""The oracle: what the best tracker could report from the given detections."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import tracking
from scenarios.loading.resolve import load
from sim.sequence import simulate
from tracking.oracle import oracle
from tracking.running.run import track
from tracking.scoring import evaluate


@pytest.fixture(scope="module", params=["merge", "stairs", "queue"])
def scene(request):
    return simulate(load(request.param), 3)


@pytest.mark.parametrize("similarity", [None, "boxes", "image"])
def test_the_oracle_only_misses(scene, similarity) -> None:
    found = evaluate(scene.truth, oracle(scene, {}, similarity), similarity=similarity)
    assert found.similarity == (similarity or "ground")
    assert found["FP"] == 0
    # Of two people nearer to each other than the error of a detection, the scores may match it with the other.
    assert found["IDSW"] <= 0.004 * len(scene.truth.id)
    assert similarity == "image" or found["group_IDSW"] == 0  # in the image, hulls of two groups may lie on each other
    assert 0 < found["FN"] < 0.35 * len(scene.truth.id)
    for key in ("merge_F1", "queue_F1", "cross_F1"):
        assert np.isnan(found[key]) or found[key] == 1, key
    assert not np.isfinite(found["group_F1"]) or found["group_F1"] > 0.7


def test_without_faults_of_the_detector_the_oracle_is_perfect(scene) -> None:
    found = evaluate(scene.truth, oracle(scene, {"detections": "truth"}))
    assert found["HOTA"] == pytest.approx(1)
    assert found["objective"] == pytest.approx(1)


def test_the_oracle_gets_what_the_tracker_got(scene) -> None:
    poor = track("blob", scene, detections="truth", sensor={"detect_prob": 0.5, "clutter_rate": 3.0}, seed=4)
    best = evaluate(scene.truth, oracle(scene, poor.info))
    assert best["FP"] == 0
    assert 0.3 * len(scene.truth.id) < best["FN"] < 0.7 * len(scene.truth.id)
    again = oracle(scene, {**poor.info, "seed": 5})
    assert any(len(a.id) != len(b.id) for a, b in zip(oracle(scene, poor.info), again, strict=True))


def test_from_stereo_pairs_the_oracle_has_the_visible_people(scene) -> None:
    run = oracle(scene, {"detections": "image", "input": "stereo"})
    found = evaluate(scene.truth, run)
    assert found.similarity == "ground"
    assert found["FN"] == sum(scene.truth.visibility == 0)


def test_compare_ranks_runs_and_shows_an_oracle_for_each_input() -> None:
    scenes = [simulate(load("split", ["camera.fps=5"]), seed) for seed in range(2)]
    runs = {name: [track(name, scene, detections="file") for scene in scenes] for name in ("blob", "relational")}
    poor = {"detections": "truth", "sensor": {"detect_prob": 0.5}}
    runs |= {str(seed): [track("blob", scene, seed=seed, **poor) for scene in scenes] for seed in (4, 5)}
    found = tracking.compare(scenes, runs)
    table = found.to_arrow("HOTA").to_pydict()
    names = ["boxes (file)", *(f"boxes (truth, detect_prob = 0.5, seed {n})" for n in (4, 5)), "points (file)"]
    assert table["run"][:4] == [f"oracle from {name}" for name in names]
    assert set(table["run"][4:]) == {*runs}
    assert dict(zip(table["run"], table["input"], strict=True))["relational"] == "points (file)"
    assert table["first"] == [*[None] * 4, *[1] * 4]
    assert table["mean"][4:] == sorted(table["mean"][4:], reverse=True)
    assert table["mean"][1] != table["mean"][2]
    again = tracking.compare(scenes, dict(reversed(runs.items())))
    assert repr(again.to_arrow("HOTA").to_pydict()) == repr(table)
    for name, row in runs.items():
        expected = np.mean([evaluate(s.truth, run)["HOTA"] for s, run in zip(scenes, row, strict=True)])
        assert table["HOTA"][table["run"].index(name)] == pytest.approx(expected)


def test_an_oracle_of_detections_without_owners_is_matched_and_says_so() -> None:
    scene = simulate(load("split", ["camera.fps=5"]), 0)
    recorded = replace(scene, load_owners=None)
    for sequence, words in ((scene, ""), (recorded, ", matched")):
        run = track("blob", sequence, detections="file")
        found = tracking.compare([sequence], {"blob": [run]})
        assert found.to_arrow("HOTA").to_pydict()["run"][0] == f"oracle from boxes (file){words}"
    assert oracle(recorded, {"detections": "truth"}).info["owners"] == "known"
