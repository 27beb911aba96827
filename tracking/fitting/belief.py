"""`fit_belief`: fits the belief of who belongs together to simulated scenes, by penalised maximum likelihood.

Every scene weighs the same. The penalty is on the squared log-odds, on the difference of the tables for walking and
standing, and on the curvature of the tables.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from scenarios.errors import InputError
from sim.types import Array, Bools
from tracking.fitting.belief_kernels import loss_and_gradient
from tracking.fitting.grouping_scenes import PairScene
from tracking.grouping.belief import Belief, Table, stands
from tracking.grouping.pair_evidence import NAMES, TIMES

USED = (
    *(f"{name}, {time:g} s" for name in ("distance", "velocity difference", "share near", "sideways")
      for time in TIMES),
    "lengthwise, 2 s", "lengthwise, 5 s", "others, 2 s", "stream, 2 s", "speed, 2 s", "distance", "arrival gap",
    "first distance",
)  # fmt: skip
"""Quantities that get a table."""
KNOTS = 10
"""Most knots of a table: quantiles of the quantity, evenly spaced from 0.5 to 99.5 %."""
CURVED, LARGE = 3e-4, 1e-4
"""Weights of the penalties: of curvature; of size, and of the difference of walking and standing."""
STEPS = 200
"""Most iterations."""


@dataclass(frozen=True)
class PairSample:
    """Rows of scenes, one after the other, sorted by pair and step: values (R, len(NAMES)); gap (R,): s since the
    pair's row before, -1 in its first; together (R,); weight (R,), of sum 1, equal for all scenes."""

    values: np.ndarray
    gap: Array
    together: Bools
    weight: Array


def sample_of(scenes: Sequence[PairScene]) -> PairSample:
    """Returns the rows of scenes. Raises InputError if there are none."""
    if not scenes:
        remedy = "name scenarios with people who meet"
        raise InputError(place="fit grouping", got="no two people within 4 m", expected="pairs", remedy=remedy)
    gaps = [np.where(np.diff(s.pair, prepend=-1) == 0, np.diff(s.step, prepend=0) * s.seconds, -1.0) for s in scenes]
    weight = np.concatenate([np.full(len(s.pair), 1 / len(s.pair) / len(scenes)) for s in scenes])
    return PairSample(
        np.concatenate([s.values for s in scenes]), np.concatenate(gaps),
        np.concatenate([s.together for s in scenes]), weight,
    )  # fmt: skip


def fit_belief(sample: PairSample, used: Sequence[str] = USED) -> Belief:
    """Returns the belief with the least penalised log loss on a sample. used: names of the quantities with a table."""
    knots_of = {name: _knots(sample.values[:, NAMES.index(name)]) for name in used}
    knots_of = {name: at for name, at in knots_of.items() if len(at) > 1}
    at, columns = list(knots_of.values()), [NAMES.index(name) for name in knots_of]
    place, part = _places(sample.values[:, columns], at)
    curves, knots = _curvature(at), sum(map(len, at))
    standing, log_odds = stands(sample.values), np.empty(len(sample.gap))

    def objective(x: Array) -> tuple[float, Array]:
        walk, stand, rest = x[:knots], x[knots : 2 * knots], x[2 * knots :]
        gradient = np.zeros_like(x)
        loss = loss_and_gradient(
            place, part, standing, sample.gap, sample.together, sample.weight, walk, stand, rest, log_odds, gradient
        )
        for own, slope in ((walk, gradient[:knots]), (stand, gradient[knots : 2 * knots])):
            bent = curves @ own
            loss += float(CURVED * bent @ bent + LARGE * own @ own)
            slope += 2 * CURVED * curves.T @ bent + 2 * LARGE * own
        differ = 2 * LARGE * (walk - stand)
        gradient[:knots] += differ
        gradient[knots : 2 * knots] -= differ
        times = rest[1:]
        gradient[2 * knots + 1 :] += 2 * LARGE * times
        return loss + LARGE * float(times @ times + (walk - stand) @ (walk - stand)), gradient

    start = np.concatenate([np.zeros(2 * knots), [-2.0, -1.0, 0.0]])
    bounds = [(None, None)] * (2 * knots + 1) + [(np.log(0.05), np.log(60.0))] * 2
    found = minimize(
        objective, start, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": STEPS, "maxcor": 20}
    ).x
    cuts = np.cumsum([len(k) for k in at])[:-1]
    walking, standing_ = (np.split(found[n * knots : (n + 1) * knots], cuts) for n in (0, 1))
    tables = tuple(Table(*row) for row in zip(knots_of, at, walking, standing_, strict=True))
    bias, walk_time, stand_time = found[2 * knots :]
    return Belief(tables, float(bias), float(np.exp(walk_time)), float(np.exp(stand_time)))


def log_odds_of(belief: Belief, sample: PairSample) -> Array:
    """Returns the belief (R,) of each row of a sample."""
    place, part = _places(sample.values[:, [NAMES.index(t.name) for t in belief.tables]], [t.at for t in belief.tables])
    walk, stand = (np.concatenate([getattr(t, name) for t in belief.tables]) for name in ("walking", "standing"))
    rest = np.array([belief.bias, np.log(belief.walking_time), np.log(belief.standing_time)])
    out = np.empty(len(sample.gap))
    loss_and_gradient(
        place, part, stands(sample.values), sample.gap, sample.together, sample.weight, walk, stand, rest, out,
        np.zeros(2 * len(walk) + 3),
    )  # fmt: skip
    return out


def _knots(values: Array) -> Array:
    known = values[np.isfinite(values)]
    return np.unique(np.quantile(known, np.linspace(0.005, 0.995, KNOTS)).round(3)) if len(known) else np.zeros(0)


def _places(values: Array, at: Sequence[Array]) -> tuple[np.ndarray, np.ndarray]:
    """Returns the index of the knot below each value, among all knots, -1 if unknown, and how far it is to the next.

    values (R, Q); at: knots of each quantity. Both results (R, Q).
    """
    place, part = np.full(values.shape, -1, np.int16), np.zeros(values.shape, np.float32)
    offset = 0
    for q, knots in enumerate(at):
        x = values[:, q]
        known = np.isfinite(x)
        x = np.clip(x[known], knots[0], knots[-1])
        below = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, len(knots) - 2)
        place[known, q] = below + offset
        part[known, q] = (x - knots[below]) / (knots[below + 1] - knots[below])
        offset += len(knots)
    return place, part


def _curvature(at: Sequence[Array]) -> Array:
    """Returns the matrix that gives the bends of all tables at their inner knots, relative to each table's range."""
    rows, offset, total = [], 0, sum(map(len, at))
    for knots in at:
        wide = knots[-1] - knots[0]
        for k in range(1, len(knots) - 1):
            a, b = (knots[k] - knots[k - 1]) / wide, (knots[k + 1] - knots[k]) / wide
            row = np.zeros(total)
            row[offset + k - 1 : offset + k + 2] = 1 / a, -1 / a - 1 / b, 1 / b
            rows.append(0.2 * np.sqrt((a + b) / 2) * row)
        offset += len(knots)
    return np.array(rows).reshape(-1, total)
