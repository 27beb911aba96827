import numpy as np
import pytest

from sim.io.formats.unit_scores import unit_scores
from sim.io.source import open_source

DRAWN = {
    "margins": np.random.default_rng(1).gamma(3, 9, 900) + 3,
    "logits": np.random.default_rng(2).normal(1, 2, 900),
    "percent": np.random.default_rng(3).uniform(20, 100, 900),
}


def test_scores_in_0_to_1_stay():
    assert unit_scores(np.array([0.2, 1.0]))[0].tolist() == [0.2, 1.0]
    assert unit_scores(np.zeros(0))[0].tolist() == []


def test_equal_scores_say_nothing():
    assert unit_scores(np.array([-1.0, -1.0]))[0].tolist() == [1.0, 1.0]


@pytest.mark.parametrize("kind", DRAWN)
@pytest.mark.parametrize("outlier", [400, -1e5, 1e6])
def test_an_outlier_moves_no_other_score(kind, outlier):
    score = DRAWN[kind]
    mapped, told = unit_scores(score)
    again, _ = unit_scores(np.append(score, outlier))
    assert np.abs(again[:-1] - mapped).max() < 0.02
    assert 0 <= mapped.min() < mapped.max() <= 1
    assert (np.diff(mapped[np.argsort(score)]) >= 0).all()
    assert 0.7 < np.mean(mapped >= 0.5) < 0.8
    assert "mapped into 0 to 1 by" in told


def test_an_outlier_among_shares_is_clipped():
    score = np.random.default_rng(4).uniform(0.5, 1, 400)
    mapped, told = unit_scores(np.append(score, 400.0))
    assert mapped.tolist() == [*score.tolist(), 1.0]
    assert told == "1 of 401 scores outside 0 to 1 are clipped"


def test_the_map_is_said(tmp_path):
    path = tmp_path / "det.txt"
    path.write_text("".join(f"{k},-1,5,5,10,20,{10 * k}\n" for k in range(1, 9)))
    with pytest.warns(UserWarning, match="scores from 10 to 80 are mapped"):
        (sequence,) = open_source(path, fps=25)
    assert [f.detections.score[0] >= 0.5 for f in sequence] == [False] * 2 + [True] * 6
