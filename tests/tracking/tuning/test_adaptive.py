"""A policy fitted to played windows does in each situation what was good there, and leaves alone what has no effect."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.config import Config
from tracking.papers.blob.config import BlobConfig
from tracking.parameter_space import decode, encode, moved, space_of
from tracking.running.signals import NAMES
from tracking.tuning.adaptive import Played, drawn_residuals, fitted_policy

SPACE = tuple(
    p for p in space_of(BlobConfig, "file", online=True) if p.name in ("gate", "position_noise", "size_noise")
)
FOUND, TIME = NAMES.index("found"), NAMES.index("time")


def pool(residuals: np.ndarray, scenes: int = 6, windows: int = 40) -> list[list[Played]]:
    """Scenes that change in the middle: position_noise should be high where few are found, size_noise always low, and
    the gate has no effect. Time tells the same as what is found."""
    random, order = np.random.default_rng(5), [p.name for p in SPACE]
    high, low = order.index("position_noise"), order.index("size_noise")
    made = []
    for one in residuals:
        row = []
        for _ in range(scenes):
            bad = np.arange(windows + 1) >= windows // 2
            seen = np.zeros((windows + 1, len(NAMES)))
            seen[:, FOUND] = np.where(bad, 0.3, 0.9) + random.normal(0, 0.03, windows + 1)
            seen[:, TIME] = np.linspace(0, 1, windows + 1)
            want = np.where(bad[1:], 0.5, -0.5)
            score = 0.8 - 0.3 * (one[high] - want) ** 2 - 0.3 * (one[low] + 0.4) ** 2
            row.append(
                Played(seen, np.tile(one, (windows, 1)), score + random.normal(0, 0.02, windows), float(score.mean()))
            )
        made.append(row)
    return made


def test_it_finds_what_is_good_where() -> None:
    residuals = drawn_residuals(SPACE, 40, np.random.default_rng(1))
    policy = fitted_policy(BlobConfig(), SPACE, pool(residuals), 1e-4, 0.05, 0.9)
    seen = np.zeros((2, len(NAMES)))
    seen[:, FOUND] = 0.9, 0.3
    good, bad = (dict(zip([p.name for p in policy.space], policy.residual(one), strict=True)) for one in seen)
    assert good["position_noise"] == pytest.approx(-0.5, abs=0.1)
    assert bad["position_noise"] == pytest.approx(0.5, abs=0.1)
    assert good["size_noise"] == pytest.approx(-0.4, abs=0.1)
    assert bad["size_noise"] == pytest.approx(-0.4, abs=0.1)
    assert abs(good.get("gate", 0.0)) < 0.1
    assert abs(bad.get("gate", 0.0)) < 0.1
    assert all("time" not in row for row in policy.weights.values())


def test_where_nothing_matters_nothing_changes() -> None:
    residuals = drawn_residuals(SPACE, 12, np.random.default_rng(1))
    same = [
        [Played(one.seen, one.residual, np.full(len(one.score), 0.7), 0.7) for one in row] for row in pool(residuals)
    ]
    assert not any(fitted_policy(BlobConfig(), SPACE, same, 1e-4, 0.05, 0.9).weights.values())


def test_residuals_begin_with_none_and_stay_in_range() -> None:
    found = drawn_residuals(SPACE, 500, np.random.default_rng(0))
    assert not found[0].any()
    assert np.abs(found).max() <= 1
    assert 0.2 < (found[1:] != 0).mean() < 0.4
    assert np.array_equal(found, drawn_residuals(SPACE, 500, np.random.default_rng(0)))


def test_constants() -> None:
    base = BlobConfig(gate=0.9)

    def constant(residual: np.ndarray) -> Config:
        return decode(SPACE, moved(SPACE, residual, base), base)

    assert constant(np.zeros(3)) == base
    assert encode(SPACE, constant(np.array([1.0, -1.0, 1.0]))) == pytest.approx([1, -1, 1])
