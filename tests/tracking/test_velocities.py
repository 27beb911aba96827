"""Tracks without velocities: the same answers score the same from a class, a table and a text."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.store.track_files import write_tracks
from sim.types import Sequence, Tracks
from tests.fake_tracker import Nearest
from tracking.grouping.grouped_tracks import with_velocities
from tracking.recordings.track_texts import read_tracks
from tracking.running.run import grouped, track
from tracking.scoring import evaluate

FPS = 10.0


class Numbers(Nearest):
    """Numbers the true people, on a grid of 1 cm and 1 px. No velocities."""

    needs = ("boxes",)
    plane = "image"

    def step(self, frame, detections):
        box = detections.box.round()
        pos = (box[:, :2] + box[:, 2:] / 2) if self.plane == "image" else detections.pos.round(2)
        found = super().step(frame, detections.replace(plane=self.plane, pos=pos, box=box))
        return found.replace(vel=np.full(pos.shape, np.nan), score=np.ones(len(pos)))


class OnTheGround(Numbers):
    plane = "ground"


@pytest.fixture(scope="module")
def merge() -> Sequence:
    return simulate(load("merge", [f"camera.fps={FPS:g}"]), 40_001)


def same(a: dict[str, float], b: dict[str, float]) -> list[str]:
    """The keys whose values differ, apart from scores of the covariances, which a text has not."""
    keys = [k for k in a if k in b and not (np.isnan(a[k]) or np.isnan(b[k]))]
    assert {"HOTA", "group_F1", "event_F1", "objective"} <= set(keys)
    return [k for k in keys if abs(a[k] - b[k]) > 1e-12]


@pytest.mark.parametrize("kind", [Numbers, OnTheGround])
def test_class_table_and_text_of_the_same_answers_score_the_same(merge, tmp_path: Path, kind) -> None:
    run = track(kind, merge, detections="truth")
    assert np.isnan(run[0].vel).all()
    assert np.isfinite(run[-1].vel).all()
    folder = write_tracks(tmp_path / "run", run, fps=merge.fps, info=run.info)
    shutil.copy(folder / "tracks.txt", tmp_path / "theirs.txt")
    text = grouped(read_tracks(tmp_path / "theirs.txt", fps=merge.fps, length=merge.length), merge)
    scores = evaluate(merge.truth, run)
    assert scores["group_F1"] > 0.3
    assert same(scores, evaluate(merge.truth, read_tracks(folder))) == []
    assert same(scores, evaluate(merge.truth, text)) == []


def moving(vel: float, n: int = 40) -> list[Tracks]:
    """One person who walks at 1 m/s along x, and reports `vel`."""
    one, alone = np.array([3]), np.array([-1])
    return [
        Tracks(k + 1, k / FPS, "ground", "person", one, alone, np.array([[k / FPS, 0.0]]), np.array([[vel, 0.0]]),
               np.zeros((1, 4, 4)))
        for k in range(n)
    ]  # fmt: skip


def test_unknown_velocities_become_the_motion_over_half_a_second() -> None:
    filled = with_velocities(moving(np.nan, 10), FPS)
    assert np.isnan(filled[0].vel).all()
    assert all(t.vel == pytest.approx(np.array([[1.0, 0.0]])) for t in filled[1:])
    known = moving(0.3, 10)
    assert all(t is k for t, k in zip(with_velocities(known, FPS), known, strict=True))
    mixed = [*moving(0.3, 6), *moving(np.nan, 10)[6:]]
    assert [float(t.vel[0, 0]) for t in with_velocities(mixed, FPS)] == pytest.approx([0.3] * 6 + [1.0] * 4)
