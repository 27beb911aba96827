"""HOTA, CLEAR, Identity: equal to TrackEval on random and real cases, ties included; exactly 1 for the truth."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.io.formats.mot_text import read_table
from sim.sequence import simulate
from sim.types import Tracks
from tests.matrix_pairs import matrix_pairs
from tests.reference_trackeval import box_similarity, trackeval_scores
from tracking.scoring import evaluate
from tracking.scoring.candidate_pairs import box_pairs
from tracking.scoring.evaluation import people_scores
from tracking.scoring.rows import FrameRows

SEEDS = range(60)


def random_case(seed: int, values=None, crowd: int = 9):
    """Frames with 0 … crowd - 1 on each side, those of equal number mostly similar; values: what similarities are."""
    r = np.random.default_rng(seed)
    true, est, similarity = [], [], []
    for _ in range(int(r.integers(1, 30))):
        i, j = (r.permutation(crowd)[: r.integers(0, crowd)] + offset for offset in (3, 500))
        s = r.random((len(i), len(j))) if values is None else r.choice(values, (len(i), len(j)))
        s *= r.random(s.shape) < 0.5
        s[(i[:, None] - 3 == j[None] - 500) & (r.random(s.shape) < 0.7)] = 0.75
        true.append(i), est.append(j), similarity.append(s)
    return true, est, similarity


def assert_equal_to_trackeval(true, est, similarity, pairs=None) -> None:
    expected = trackeval_scores(true, est, similarity)
    assert people_scores(pairs or matrix_pairs(true, est, similarity)) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_equal_to_trackeval(seed: int) -> None:
    assert_equal_to_trackeval(*random_case(seed))


@pytest.mark.parametrize("seed", SEEDS)
def test_equal_to_trackeval_where_similarities_tie(seed: int) -> None:
    """Quarters add up exactly: whole matchings are equally good, and which one is taken shows in switches and AssA."""
    assert_equal_to_trackeval(*random_case(seed, values=(0.25, 0.5, 0.75, 1.0)))


@pytest.mark.parametrize("seed", range(5))
def test_equal_to_trackeval_in_a_crowd(seed: int) -> None:
    assert_equal_to_trackeval(*random_case(seed, crowd=60))


@pytest.mark.parametrize(
    "case",
    [
        ([[]], [[]], [np.zeros((0, 0))]),
        ([[1, 2], [2]], [[], []], [np.zeros((2, 0)), np.zeros((1, 0))]),
        ([[], []], [[4], [4, 5]], [np.zeros((0, 1)), np.zeros((0, 2))]),
        ([[1], [], [1]], [[4], [4], [5]], [np.ones((1, 1)), np.zeros((0, 1)), np.ones((1, 1))]),
        ([[1], [1], [1]], [[4], [], [4]], [np.ones((1, 1)), np.zeros((1, 0)), np.ones((1, 1))]),
        ([[1], [1], [1]], [[4], [5], [4]], [np.ones((1, 1)), np.zeros((1, 1)), np.ones((1, 1))]),
        ([[1, 2]], [[4, 5]], [np.zeros((2, 2))]),
        ([[1, 2]], [[4, 5]], [np.full((2, 2), 0.5)]),
        ([[1]], [[4]], [np.full((1, 1), 0.5 - 1e-16)]),
    ],
    ids=[
        "nothing",
        "no tracks",
        "no truth",
        "nobody true",
        "nobody said",
        "a miss",
        "far",
        "all equal",
        "rounded half",
    ],
)
def test_equal_to_trackeval_at_the_edges(case) -> None:
    assert_equal_to_trackeval(*case)


@pytest.mark.parametrize("name", ["PETS09-S2L1-first200", "TUD-Campus"])
@pytest.mark.parametrize("kind", ["detections", "disturbed"])
def test_equal_to_trackeval_on_real_boxes(shared_data, name: str, kind: str) -> None:
    """Tracks are the detections numbered anew in each frame, or true boxes that shake, are missed and change ids."""
    folder = shared_data / "mot" / name
    truth = by_frame(read_table(folder / "gt" / "gt.txt"))
    if kind == "detections":
        t = read_table(folder / "det" / "det.txt")
        order = np.argsort(t.frame, kind="stable")
        number = np.arange(len(order)) - np.searchsorted(t.frame[order], t.frame[order])
        tracks = t.frame[order], number, t.box[order]
    else:
        tracks = disturbed(*truth)
    frames = np.arange(1, max(truth[0].max(), tracks[0].max()) + 1)
    true, est, similarity = [], [], []
    for f in frames:
        (i, a), (j, b) = ((ids[frame == f], box[frame == f]) for frame, ids, box in (truth, tracks))
        true.append(i), est.append(j), similarity.append(box_similarity(a, b))
    pairs = box_pairs(FrameRows(*truth[:2]), FrameRows(*tracks[:2]), truth[2], tracks[2])
    assert_equal_to_trackeval(true, est, similarity, pairs)


def by_frame(t):
    order = np.argsort(t.frame, kind="stable")
    return t.frame[order], t.id[order], t.box[order]


def disturbed(frame, ids, box):
    r = np.random.default_rng(0)
    kept = r.random(len(frame)) < 0.9
    changes = np.cumsum(r.random(len(frame)) < 0.02)
    return frame[kept], (ids + 1000 * changes)[kept], (box + r.normal(0, 4, box.shape))[kept]


@pytest.mark.parametrize("seed", range(10))
def test_numbers_of_ids_and_order_of_rows_change_nothing(seed: int) -> None:
    true, est, similarity = random_case(seed)
    r = np.random.default_rng(seed)
    other = r.permutation(10_000)
    moved = []
    for i, j, s in zip(true, est, similarity, strict=True):
        a, b = r.permutation(len(i)), r.permutation(len(j))
        moved.append((other[i[a]], other[j[b]], s[a][:, b]))
    assert people_scores(matrix_pairs(*zip(*moved, strict=True))) == pytest.approx(
        people_scores(matrix_pairs(true, est, similarity)), abs=1e-12
    )


@pytest.mark.parametrize("seed", range(10))
def test_scores_of_every_beginning(seed: int) -> None:
    true, est, similarity = random_case(seed)
    whole = matrix_pairs(true, est, similarity)
    for n in range(1, len(true) + 1):
        part = whole.in_frames(np.arange(len(true)) < n)
        assert people_scores(part) == people_scores(matrix_pairs(true[:n], est[:n], similarity[:n]))


def test_an_id_twice_in_a_frame_is_refused() -> None:
    with pytest.raises(ValueError, match="truth: id 7 is twice in frame 1"):
        people_scores(matrix_pairs([[7], [7, 8, 7]], [[], []], [np.zeros((1, 0)), np.zeros((3, 0))]))
    with pytest.raises(ValueError, match="tracks: id 2 is twice in frame 0"):
        people_scores(matrix_pairs([[]], [[2, 2]], [np.zeros((0, 2))]))


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
