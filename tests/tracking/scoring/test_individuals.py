"""Scores of individuals: equal to TrackEval on random cases, exactly 1 for the truth itself."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.loading import load
from sim.sequence import simulate
from sim.types import Tracks
from tracking.scoring import evaluate
from tracking.scoring.individuals import scores


def random_case(seed: int):
    r = np.random.default_rng(seed)
    frames = int(r.integers(1, 30))
    true, est, similarity = [], [], []
    for _ in range(frames):
        i = r.permutation(8)[: r.integers(0, 8)]
        j = r.permutation(9)[: r.integers(0, 9)]
        s = r.random((len(i), len(j))) * (r.random((len(i), len(j))) < 0.5)
        s[(i[:, None] == j[None]) & (r.random(s.shape) < 0.7)] = 0.8
        true.append(i), est.append(j), similarity.append(s)
    return true, est, similarity


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("seed", range(50))
def test_equal_to_trackeval(seed: int) -> None:
    metrics = pytest.importorskip("trackeval.metrics", reason="trackeval is installed by `make test`")
    true, est, similarity = random_case(seed)
    ours = scores(true, est, similarity)
    renumber = [{k: n for n, k in enumerate(np.unique(np.concatenate(x)))} for x in (true, est)]
    data = {
        "gt_ids": [np.array([renumber[0][k] for k in i], int) for i in true],
        "tracker_ids": [np.array([renumber[1][k] for k in j], int) for j in est],
        "similarity_scores": similarity,
        "num_gt_ids": len(renumber[0]),
        "num_tracker_ids": len(renumber[1]),
        "num_gt_dets": sum(map(len, true)),
        "num_tracker_dets": sum(map(len, est)),
        "num_timesteps": len(true),
    }
    if data["num_gt_dets"] == 0 or data["num_tracker_dets"] == 0:
        pytest.skip("TrackEval answers empty sides by rule, not by its formulas")
    theirs = metrics.HOTA().eval_sequence(data)
    for key in ("HOTA", "DetA", "AssA", "LocA"):
        assert ours[key] == pytest.approx(float(np.mean(theirs[key])), abs=1e-6), key
    quiet = {"THRESHOLD": 0.5, "PRINT_CONFIG": False}
    for metric, keys in (
        (metrics.CLEAR(quiet), ("MOTA", "MOTP", "IDSW")),
        (metrics.Identity(quiet), ("IDF1", "IDP", "IDR")),
    ):
        theirs = metric.eval_sequence(data)
        for key in keys:
            assert ours[key] == pytest.approx(float(theirs[key]), abs=1e-6), key


@pytest.mark.parametrize("similarity", ["boxes", "ground", "image"])
def test_truth_as_tracks_is_perfect(similarity: str) -> None:
    truth = simulate(load("merge"), 1).truth
    tracks = []
    for index in range(1, truth.length + 1):
        t = truth.at(index)
        n = len(t.id)
        tracks.append(
            Tracks(index, t.t, "ground", "person", t.id, t.group, t.pos, t.vel, np.zeros((n, 4, 4)), t.box, np.ones(n))
        )
    if similarity == "image":
        tracks = [t.replace(plane="image") for t in tracks]
    found = evaluate(truth, tracks, similarity=similarity)
    for key in ("HOTA", "DetA", "AssA", "MOTA", "IDF1"):
        assert found[key] == pytest.approx(1.0, abs=1e-12), key
