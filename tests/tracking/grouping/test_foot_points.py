"""Boxes of calibrated data have one way to groups: a class that passes them on, and its text, score the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from scenarios.loading.resolve import load
from sim.io.store.track_files import read_tracks, write_tracks
from sim.sequence import simulate
from sim.types import Sequence, Tracks
from tracking import evaluate, track
from tracking.grouping.grouped_tracks import without_groups
from tracking.objective import ObjectiveScorer
from tracking.scoring.evaluation import Scorer

KEYS = ("objective", "HOTA", "group_F1")


class Passer:
    """Passes detected boxes on, in the image and without groups; an id goes to the nearest box of the next frame."""

    needs = ("boxes",)

    def reset(self, context, seed):
        self.ids, self.last, self.next = np.zeros(0, np.int64), np.zeros((0, 2)), 0

    def step(self, frame, detections):
        box = np.round(detections.box, 2)  # as a text holds them
        middle, n = box[:, :2] + box[:, 2:] / 2, len(box)
        apart = np.linalg.norm(self.last[:, None] - middle[None], axis=2)
        id = np.full(n, -1)
        for i, j in zip(*linear_sum_assignment(apart), strict=True):
            id[j] = self.ids[i] if apart[i, j] < 40 else -1
        new = np.flatnonzero(id < 0)
        id[new] = self.next + np.arange(len(new))
        self.ids, self.last, self.next = id, middle, self.next + len(new)
        rows = (id, np.full(n, -1), middle, np.full((n, 2), np.nan), np.zeros((n, 4, 4)), box, np.ones(n))
        return Tracks(frame.index, frame.t, "image", "person", *rows)


@pytest.fixture(scope="module", params=["merge", "stairs"])
def scene(request) -> Sequence:
    settings = ["camera.fps=5", "camera.kind=pinhole", "camera.tilt_deg=40"]
    return simulate(load(request.param, settings), 7, 0, ())


@pytest.fixture(scope="module")
def run(scene):
    return track(Passer, scene, detections="truth")


def text_of(run, folder: Path, scene: Sequence) -> list[Tracks]:
    write_tracks(folder, run, fps=scene.fps, camera=scene.camera, info=run.info)
    (folder / "alone").mkdir()
    (folder / "tracks.mot.txt").rename(folder / "alone" / "passer.txt")
    return list(read_tracks(folder / "alone" / "passer.txt", fps=scene.fps, length=scene.length))


@pytest.mark.parametrize("similarity", [None, "image"])
def test_a_class_and_its_text_score_the_same(scene, run, tmp_path, similarity) -> None:
    text = text_of(run, tmp_path / "run", scene)
    assert run[9].plane == text[9].plane == "image"
    assert run[9].groups is not None
    assert text[9].groups is None
    mine, other = (evaluate(scene.truth, tracks, similarity=similarity) for tracks in (run, text))
    assert dict(mine) == pytest.approx(dict(other), nan_ok=True, abs=1e-12)
    assert mine["group_F1"] > 0


@pytest.mark.parametrize("similarity", [None, "image"])
def test_the_objective_of_boxes_is_that_of_all_scores(scene, run, similarity) -> None:
    bare = without_groups(run)
    scorer = ObjectiveScorer(scene.truth)
    for last in (1, 12, len(bare)):
        found = scorer.scores(bare[:last], scene.px_per_m, similarity=similarity)
        expected = Scorer(scene.truth).evaluate(bare[:last], similarity=similarity, frames=last)
        assert [found[k] for k in KEYS] == pytest.approx([expected[k] for k in KEYS], abs=1e-12, nan_ok=True)
