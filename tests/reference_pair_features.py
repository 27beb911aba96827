"""The features of benchmarks/belonging/pair_features.py, pair by pair and frame by frame, as their texts say."""

from __future__ import annotations

import math

import numpy as np

TIMES = (0.8, 2.0, 5.0, 15.0)


def pair_features(places: dict[int, dict[int, tuple[float, float]]], fps: float) -> dict[tuple[int, int, int], list]:
    """Returns 21 features by (frame, a, b). places: frame → id → position, m."""
    rows = {}
    people = sorted({p for here in places.values() for p in here})
    for a in people:
        for b in people:
            both = [t for t in sorted(places) if a in places[t] and b in places[t]]
            if a < b and any(math.dist(places[t][a], places[t][b]) < 5.0 for t in both):
                rows |= {(t, a, b): features_at(places, [s for s in both if s <= t], a, b, fps) for t in both}
    return rows


def features_at(places: dict, both: list[int], a: int, b: int, fps: float) -> list[float]:
    """Returns the features of two people in the last of the frames `both`, in all of which both are present."""
    t = both[-1]
    first = [min(s for s in places if p in places[s]) for p in (a, b)]
    middle = np.mean([places[t][a], places[t][b]], axis=0)
    others = sum(p not in (a, b) and math.dist(x, middle) < 3.0 for p, x in places[t].items())
    means = [
        mean_until(both, [now(places, s, a, b, fps)[k] for s in both], fps, tau) for k in range(4) for tau in TIMES
    ]
    return [
        *means,
        (t - max(first)) / fps,
        math.dist(places[both[0]][a], places[both[0]][b]),
        abs(first[0] - first[1]) / fps,
        others,
        (speed(places, t, a, fps) + speed(places, t, b, fps)) / 2,
    ]


def mean_until(frames: list[int], values: list[float], fps: float, time: float) -> float:
    known = [(math.exp(-(frames[-1] - s) / fps / time), x) for s, x in zip(frames, values, strict=True) if x == x]
    return sum(w * x for w, x in known) / sum(w for w, _ in known) if known else math.nan


def velocity(places: dict, t: int, p: int, fps: float) -> np.ndarray:
    """Returns the difference to the earliest of the last two frames, m/s; nan if the person was in neither."""
    before = [s for s in (t - 2, t - 1) if p in places.get(s, {})]
    if not before:
        return np.full(2, math.nan)
    return np.subtract(places[t][p], places[before[0]][p]) * fps / (t - before[0])


def speed(places: dict, t: int, p: int, fps: float) -> float:
    return float(np.hypot(*velocity(places, t, p, fps)))


def now(places: dict, t: int, a: int, b: int, fps: float) -> list[float]:
    """Returns distance, velocity difference, 1 if near, and sideways of one frame."""
    apart = np.subtract(places[t][a], places[t][b])
    va, vb = velocity(places, t, a, fps), velocity(places, t, b, fps)
    distance, mean = float(np.hypot(*apart)), (va + vb) / 2
    pace = float(np.hypot(*mean))
    sideways = distance
    if pace >= 0.3:
        left = np.array([-mean[1], mean[0]]) / pace
        sideways = abs(float(apart @ left))
    return [distance, float(np.hypot(*(va - vb))), float(distance < 1.2), sideways]
