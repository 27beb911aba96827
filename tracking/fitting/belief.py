"""`fit_belief`: fits the belief of who belongs together to simulated scenes, by penalised maximum likelihood.

The weight of a scene is the number of times that it is named; all pairs of a scene have equal weight. The penalty is on
the squared log-odds and on the curvature of the tables.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from scenarios.errors import InputError
from sim.compiler import njit
from sim.types import Array, Bools, Ints
from tracking.fitting.grouping_scenes import PairScene
from tracking.grouping.belief import Belief, Table
from tracking.grouping.pair_evidence import NAMES, NEAR, OTHERS

KNOTS = 6  # Most knots of a table: quantiles of the quantity, evenly spaced from 0.5 to 99.5 %.
# Weights of the penalties: of curvature, and of squared log-odds.
CURVED, LARGE = 3e-4, 1e-4
STEPS = 200  # Most iterations.
THRESHOLDS = 100  # Evenly spaced probabilities, of which the threshold is one.


@dataclass(frozen=True)
class PairSample:
    """R rows of pairs of all scenes. values (R, len(NAMES)): quantities; together (R,): True if the two are in one true
    group; weight (R,): sum 1, equal for all pairs of a scene, in proportion to the scenes' weights; scene (R,): number
    of the scene, from 0."""

    values: np.ndarray
    together: Bools
    weight: Array
    scene: Ints
    pairs: int  # number of pairs


def sample_of(scenes: Sequence[PairScene]) -> PairSample:
    """Returns the rows of all scenes as one sample. Raises InputError if there is no scene."""
    if not scenes:
        remedy = "name scenarios with people who meet"
        raise InputError(place="fit grouping", got="no two people within 4 m", expected="pairs", remedy=remedy)
    weight = np.concatenate([_weights(s.pair) * s.weight for s in scenes]) / sum(s.weight for s in scenes)
    values, together = (np.concatenate([getattr(s, name) for s in scenes]) for name in ("values", "together"))
    scene = np.repeat(np.arange(len(scenes)), [len(s.pair) for s in scenes])
    return PairSample(values, together, weight, scene, sum(len(np.unique(s.pair)) for s in scenes))


def _weights(pair: Ints) -> Array:
    _, number, count = np.unique(pair, return_inverse=True, return_counts=True)
    return np.asarray(1 / count[number] / len(count))


def fit_belief(now: PairSample, events: PairSample | None = None, used: Sequence[str] = NAMES) -> Belief:
    """Returns the belief with the least penalised log loss.

    now, events: the samples to which the two columns of log-odds, "now" and "events", are fitted; None takes `now` for
    both. used: names of the quantities that get a table.
    """
    knots_of = {name: _knots(now.values[:, NAMES.index(name)]) for name in used}
    knots_of = {name: at for name, at in knots_of.items() if len(at) > 1}
    columns = np.stack([_fit_column(now, knots_of, OTHERS), _fit_column(events or now, knots_of, NEAR)])
    cuts = np.cumsum([len(knots) for knots in knots_of.values()])
    *heights, bias = np.split(columns, cuts, axis=1)
    tables = tuple(Table(*row) for row in zip(knots_of, knots_of.values(), heights, strict=True))
    belief = Belief(tables, bias[:, 0])
    return replace(belief, threshold=best_threshold(now, belief.log_odds(now.values)[:, 0]))


def _fit_column(sample: PairSample, knots_of: Mapping[str, Array], left_out: tuple[str, ...]) -> Array:
    """Returns the log-odds at all knots, 0 at those of left out quantities, and the bias as the last number."""
    kept = {name: at for name, at in knots_of.items() if not name.startswith(left_out)}
    at = list(kept.values())
    place, part = _places(sample.values[:, [NAMES.index(name) for name in kept]], at)
    curves = _curvature(at)
    bends = curves.T @ curves

    def objective(x: Array) -> tuple[float, Array]:
        heights, slopes = x[:-1], np.zeros_like(x)
        loss, slopes[-1] = loss_and_gradient(place, part, sample.together, sample.weight, heights, x[-1], slopes[:-1])
        slopes[:-1] += 2 * CURVED * bends @ heights + 2 * LARGE * heights
        return loss + CURVED * float(heights @ bends @ heights) + LARGE * float(heights @ heights), slopes

    start = np.append(np.zeros(sum(map(len, at))), -2.0)
    options = {"maxiter": STEPS, "maxcor": 20}
    found = minimize(objective, start, jac=True, method="L-BFGS-B", options=options).x
    fitted = np.repeat([name in kept for name in knots_of], [len(at) for at in knots_of.values()])
    column = np.zeros(len(fitted) + 1)
    column[np.append(fitted, True)] = found
    return column


def best_threshold(sample: PairSample, log_odds: Array) -> float:
    """Returns the threshold with the greatest mean F1 over scenes with pairs in one true group; of several the middle.
    A pair counts as together if its probability is above the threshold. log_odds (R,): beliefs of the sample's rows."""
    place = (THRESHOLDS / (1 + np.exp(-log_odds))).astype(np.int64).clip(0, THRESHOLDS - 1)
    shape = (sample.scene[-1] + 1, THRESHOLDS)
    place += sample.scene * THRESHOLDS
    count = [np.bincount(place, x, math.prod(shape)).reshape(shape) for x in (sample.together, None)]
    hits, told = (c[:, ::-1].cumsum(axis=1)[:, ::-1] for c in count)  # by scene: rows above k / THRESHOLDS
    mates = hits[:, :1]
    weight = np.bincount(sample.scene, sample.weight) * (mates[:, 0] > 0)
    f1 = weight @ (2 * hits / np.maximum(told + mates, 1))
    best = np.flatnonzero(f1 == f1.max())
    return float(best[len(best) // 2]) / THRESHOLDS


def _knots(values: Array) -> Array:
    known = values[np.isfinite(values)]
    return np.unique(np.quantile(known, np.linspace(0.005, 0.995, KNOTS)).round(3)) if len(known) else np.zeros(0)


def _places(values: Array, at: Sequence[Array]) -> tuple[np.ndarray, np.ndarray]:
    """Returns the index of the knot below each value, among all knots, -1 if unknown, and how far it is to the next."""
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


@njit(cache=True)
def loss_and_gradient(
    place: np.ndarray, part: np.ndarray, together: Bools, weight: Array, heights: Array, bias: float, gradient: Array
) -> tuple[float, float]:
    """Returns the weighted log loss of R rows and its slope with respect to the bias; adds to gradient (K,).

    place, part (R, Q): knot below each value, -1 if unknown, and how far it is to the next. heights (K,): log-odds at
    all knots.
    """
    rows, quantities = place.shape
    loss, slopes = 0.0, 0.0
    for r in range(rows):
        log_odds = bias
        for q in range(quantities):
            k = place[r, q]
            if k >= 0:
                u = part[r, q]
                log_odds += (1 - u) * heights[k] + u * heights[k + 1]
        true = 1.0 if together[r] else 0.0
        loss += weight[r] * (np.log1p(np.exp(-abs(log_odds))) + max(log_odds, 0.0) - true * log_odds)
        slope = weight[r] * (1 / (1 + np.exp(-log_odds)) - true)
        slopes += slope
        for q in range(quantities):
            k = place[r, q]
            if k >= 0:
                u = part[r, q]
                gradient[k] += slope * (1 - u)
                gradient[k + 1] += slope * u
    return loss, slopes
