"""All runs on the ground are compared with one truth, the exact positions, however the run tells places."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.scene.standing import standing_points
from sim.sequence import simulate
from sim.types import Array, Plane, Sequence, Tracks, Truth
from tracking.scoring import evaluate
from tracking.scoring.evaluation import Scorer


@pytest.fixture(scope="module", params=["merge", "crowd"])
def sequence(request: pytest.FixtureRequest) -> Sequence:
    return simulate(load(request.param), 30_000)


def reported(sequence: Sequence, plane: Plane, noise: float = 0.0) -> list[Tracks]:
    """Returns the true boxes, with errors of `noise` heights, as tracks in the image, or where they stand."""
    truth, r, found = sequence.truth, np.random.default_rng(0), []
    assert truth is not None
    for k in range(1, truth.length + 1):
        t = truth.at(k)
        assert t.box is not None
        box: Array = t.box + noise * t.box[:, 3:] * r.normal(size=t.box.shape) * [1, 1, 0, 0]
        pos = box[:, :2] + box[:, 2:] / 2
        if plane == "ground":
            assert sequence.camera is not None
            pos = standing_points(box, sequence.camera, sequence.scene)
        n = len(pos)
        unknown = np.full((n, 2), np.nan), np.full((n, 4, 4), np.nan)
        found.append(Tracks(k, t.t, plane, "person", t.id, np.full(n, -1), pos, *unknown, box))
    return found


def scores(truth: Truth, *runs: list[Tracks]) -> list[float]:
    return [found.scores("hull")["HOTA"] for found in Scorer(truth).compare(list(runs))]


@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_tracks_in_the_image_rank_as_the_same_tracks_on_the_ground(sequence: Sequence, noise: float) -> None:
    assert sequence.truth is not None
    flat, stood = scores(sequence.truth, reported(sequence, "image", noise), reported(sequence, "ground", noise))
    assert flat == stood


def test_exact_boxes_score_as_exact_positions(sequence: Sequence) -> None:
    assert sequence.truth is not None
    assert scores(sequence.truth, reported(sequence, "image"))[0] == pytest.approx(1, abs=0.002)
    assert evaluate(sequence.truth, reported(sequence, "ground"))["HOTA"] == pytest.approx(1, abs=0.002)
