import numpy as np
import pytest
from scipy.interpolate import make_smoothing_spline

from sim.dataset.replay import GAP, LIMIT, resample, smoothing_spline

RATE = 2.5


def rows(ways: dict[int, np.ndarray], first: dict[int, int] | None = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Labels of people, one (N, 2) each, from frame `first` (1) on; rows sorted by (frame, id)."""
    start = first or {}
    frame = np.concatenate([start.get(i, 1) + np.arange(len(p)) for i, p in ways.items()])
    id = np.concatenate([np.full(len(p), i) for i, p in ways.items()])
    order = np.lexsort((id, frame))
    return frame[order], id[order], np.concatenate(list(ways.values()))[order]


def curve(frames: int, rate: float = RATE) -> np.ndarray:
    t = np.arange(frames) / rate
    return np.stack([1.3 * t, 2.0 * np.sin(0.4 * t)], axis=1)


def test_smooth_ways_are_kept_and_velocities_are_theirs() -> None:
    made = resample(*rows({4: curve(40)}), RATE, 10.0, 0.0, 39 / RATE)
    t = np.arange(157) / 10
    inner = slice(10, -10)
    assert made.present.all()
    assert made.pos[:, 0] == pytest.approx(np.stack([1.3 * t, 2.0 * np.sin(0.4 * t)], axis=1), abs=0.03)
    wanted = np.stack([np.full(157, 1.3), 0.8 * np.cos(0.4 * t)], axis=1)
    assert made.vel[inner, 0] == pytest.approx(wanted[inner], abs=0.02)
    assert made.smoothing == 0.05


def test_jitter_is_smoothed_until_people_could_walk_so() -> None:
    noise = np.random.default_rng(0).normal(0, 0.08, (400, 2))
    made = resample(*rows({1: curve(400, 25.0) + noise}), 25.0, 10.0, 0.0, 399 / 25.0)
    assert made.smoothing > 0.1
    acceleration = np.linalg.norm(np.diff(made.vel[:, 0], axis=0), axis=1) * 10
    assert np.quantile(acceleration, 0.98) <= LIMIT
    t = np.arange(len(made.pos)) / 10
    away = np.linalg.norm(made.pos[:, 0] - np.stack([1.3 * t, 2.0 * np.sin(0.4 * t)], axis=1), axis=1)
    assert np.median(away) < 0.06


def test_people_come_and_go_and_long_gaps_are_absence() -> None:
    away = int(GAP * RATE) + 2
    frame, id, pos = rows({1: curve(20), 2: curve(8), 3: curve(1)}, {2: 6, 3: 2})
    gone = (id == 1) & (frame > 8) & (frame <= 8 + away)
    short = (id == 1) & (frame == 4)
    keep = ~gone & ~short
    made = resample(frame[keep], id[keep], pos[keep], RATE, 10.0, 0.0, 19 / RATE)
    assert made.id.tolist() == [1, 2]  # the third was labelled once
    t = np.arange(len(made.present)) / 10
    assert np.array_equal(made.present[:, 0], (t <= 7 / RATE + 1e-9) | (t >= (8 + away) / RATE - 1e-9))
    assert np.array_equal(made.present[:, 1], (t >= 5 / RATE - 1e-9) & (t <= 12 / RATE + 1e-9))
    assert np.isnan(made.pos[~made.present]).all()
    assert np.isfinite(made.vel[made.present]).all()


def test_a_part_is_the_part_of_the_whole() -> None:
    labels = rows({1: curve(40), 2: curve(20)}, {2: 15})
    whole = resample(*labels, RATE, 10.0, 0.0, 39 / RATE)
    part = resample(*labels, RATE, 10.0, 4.0, 8.0)
    assert np.array_equal(part.pos, whole.pos[40:81], equal_nan=True)


@pytest.mark.parametrize("weight", [1e-6, 0.01, 100.0])
def test_smoothing_is_that_of_scipy(weight: float) -> None:
    r = np.random.default_rng(3)
    t, y = np.cumsum(r.uniform(0.2, 0.8, 40)), r.normal(0, 1, (40, 2))
    for k in (0, 1):
        wanted = make_smoothing_spline(t, y[:, k], lam=weight)(t)
        assert smoothing_spline(t, y, weight)[:, k] == pytest.approx(wanted, abs=1e-7)
    assert np.array_equal(smoothing_spline(t[:2], y[:2], weight), y[:2])
    line = np.stack([t, 2.0 - t], axis=1)
    assert smoothing_spline(t, line, weight) == pytest.approx(line)
