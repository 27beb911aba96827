"""`fit_belief`: fits the belief of who belongs together to simulated scenes, by penalised maximum likelihood.

The weight of a scene is the number of times that it is named; all pairs of a scene have equal weight. The penalty is on
the squared log-odds, on the curvature of the tables and on their differences from one level of noise to the next. The
share of mates where none is known is that by which as many pairs are told to be mates as are, the thresholds are those
of the greatest F1.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.optimize import minimize

from scenarios.errors import InputError
from sim.compiler import njit
from sim.types import Array, Bools, Ints
from tracking.fitting.grouping_scenes import PairScene
from tracking.grouping.belief import Belief, Table
from tracking.grouping.mate_share import MateShare
from tracking.grouping.pair_evidence import NAMES, NEAR, OTHERS

KNOTS = 6  # Most knots of a table: quantiles of the quantity, evenly spaced from 0.5 to 99.5 %.
LEVELS = (0.0, 0.1, 0.25, 0.5, 1.0, 1.5)  # m: levels of noise.
# Weights of the penalties: of curvature, of squared log-odds, and of squared differences between levels.
CURVED, LARGE, UNLIKE = 5e-5, 1.7e-5, 1e-4
STEPS = 200  # Most iterations.
SHARES = tuple(0.02 * k for k in range(1, 13))  # Of mates, of which one is chosen.
NEARLY = 1e-3  # F1
THRESHOLDS = 100  # Evenly spaced probabilities, of which the threshold is one.


@dataclass(frozen=True)
class PairSample:
    """R rows of pairs of all scenes. values (R, len(NAMES)): quantities; noise (R,): of positions, m; together (R,):
    True if the two are in one true group; weight (R,): sum 1, equal for all pairs of a scene, in proportion to the
    scenes' weights; pair, step (R,): of the scene; scene (R,): number of the scene, from 0."""

    values: np.ndarray
    noise: Array
    together: Bools
    weight: Array
    pair: Ints
    step: Ints
    scene: Ints
    pairs: int  # number of pairs


def sample_of(scenes: Sequence[PairScene]) -> PairSample:
    """Returns the rows of all scenes as one sample. Raises InputError if there is no scene."""
    if not scenes:
        remedy = "name scenarios with people who meet"
        raise InputError(place="fit grouping", got="no two people within 4 m", expected="pairs", remedy=remedy)
    weight = np.concatenate([_weights(s.pair) * s.weight for s in scenes]) / sum(s.weight for s in scenes)
    names = ("values", "noise", "together", "pair", "step")
    values, noise, together, pair, step = (np.concatenate([getattr(s, name) for s in scenes]) for name in names)
    scene = np.repeat(np.arange(len(scenes)), [len(s.pair) for s in scenes])
    return PairSample(values, noise, together, weight, pair, step, scene, sum(len(np.unique(s.pair)) for s in scenes))


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
    *heights, bias = np.split(columns, cuts, axis=2)
    tables = tuple(Table(*row) for row in zip(knots_of, knots_of.values(), heights, strict=True))
    belief = Belief(tables, np.array(LEVELS), bias[..., 0], np.full(len(LEVELS), 0.5))
    log_odds = belief.log_odds(now.values, now.noise)[:, 0]
    shifted = {share: log_odds + shifts_of_sample(now, log_odds, share) for share in SHARES}
    mates = now.weight @ now.together
    share = min(SHARES, key=lambda share: abs(now.weight @ (1 / (1 + np.exp(-shifted[share]))) - mates))
    return replace(belief, share=share, threshold=best_thresholds(now, shifted[share]))


def log_loss(sample: PairSample, log_odds: Array) -> float:
    """Returns the weighted log loss of beliefs (R,) of the sample's rows."""
    return float(sample.weight @ (np.logaddexp(0.0, log_odds) - log_odds * sample.together))


def shifts_of_sample(sample: PairSample, log_odds: Array, share: float) -> Array:
    """Returns by how much the share of mates seen so far shifts the log-odds (R,), in each scene by itself."""
    out, cuts = np.empty(len(log_odds)), np.flatnonzero(np.diff(sample.scene, prepend=-1, append=-1))
    for low, high in pairwise(cuts):
        order = low + np.argsort(sample.step[low:high], kind="stable")
        out[order] = MateShare(share).add(sample.step[order], sample.pair[order], log_odds[order])
    return out


def _fit_column(sample: PairSample, knots_of: Mapping[str, Array], left_out: tuple[str, ...]) -> Array:
    """Returns the log-odds (L, K + 1) at all knots by level, 0 at those of left out quantities, the bias last."""
    kept = {name: at for name, at in knots_of.items() if not name.startswith(left_out)}
    at, levels = list(kept.values()), len(LEVELS)
    place, part = _places(sample.values[:, [NAMES.index(name) for name in kept]], at)
    (level,), (more,) = (x.T for x in _places(sample.noise[:, None], [np.array(LEVELS)]))
    curves, knots = _curvature(at), sum(map(len, at))
    bends = curves.T @ curves

    def objective(x: Array) -> tuple[float, Array]:
        heights, slopes = x.reshape(levels, -1), np.zeros((levels, knots + 1))
        loss = loss_and_gradient(place, part, level, more, sample.together, sample.weight, heights, slopes)
        inner, steps = heights[:, :-1], np.diff(heights, axis=0)
        slopes[:, :-1] += 2 * CURVED * inner @ bends + 2 * LARGE * inner
        slopes[1:] += 2 * UNLIKE * steps
        slopes[:-1] -= 2 * UNLIKE * steps
        loss += CURVED * float(((inner @ bends) * inner).sum()) + LARGE * float((inner * inner).sum())
        return loss + UNLIKE * float((steps * steps).sum()), slopes.ravel()

    start = np.zeros((levels, knots + 1))
    start[:, -1] = -2.0
    options = {"maxiter": STEPS, "maxcor": 20}
    found = minimize(objective, start.ravel(), jac=True, method="L-BFGS-B", options=options).x
    fitted = np.repeat([name in kept for name in knots_of], [len(at) for at in knots_of.values()])
    column = np.zeros((levels, len(fitted) + 1))
    column[:, np.append(fitted, True)] = found.reshape(levels, -1)
    return column


def best_thresholds(sample: PairSample, log_odds: Array) -> Array:
    """Returns for each level of noise the threshold (L,) with the greatest mean F1 over scenes with pairs in one true
    group; the middle of all that are nearly as good. A pair counts as together if its probability is above the
    threshold. log_odds (R,): beliefs of the sample's rows, which count for the levels of noise beside them."""
    place = (THRESHOLDS / (1 + np.exp(-log_odds))).astype(np.int64).clip(0, THRESHOLDS - 1)
    shape = (sample.scene[-1] + 1, THRESHOLDS)
    place += sample.scene * THRESHOLDS
    (level,), (more,) = (x.T for x in _places(sample.noise[:, None], [np.array(LEVELS)]))
    best = np.empty(len(LEVELS))
    for k in range(len(LEVELS)):
        part = np.where(level == k, 1 - more, np.where(level == k - 1, more, 0.0))
        count = [np.bincount(place, x * part, math.prod(shape)).reshape(shape) for x in (sample.together, 1)]
        hits, told = (c[:, ::-1].cumsum(axis=1)[:, ::-1] for c in count)  # by scene: rows above k / THRESHOLDS
        mates = hits[:, :1]
        weight = np.bincount(sample.scene, sample.weight * part) * (mates[:, 0] > 0)
        f1 = weight @ (2 * hits / np.maximum(told + mates, 1e-9)) / max(weight.sum(), 1e-9)
        best[k] = np.flatnonzero(f1 >= f1.max() - NEARLY).mean() / THRESHOLDS
    return best


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
    place: np.ndarray, part: np.ndarray, level: np.ndarray, more: np.ndarray, together: Bools, weight: Array,
    heights: Array, gradient: Array,
) -> float:  # fmt: skip
    """Returns the weighted log loss of R rows; adds its slopes to gradient (L, K + 1).

    place, part (R, Q): knot below each value, -1 if unknown, and how far it is to the next. level, more (R,): the same
    of the noise. heights (L, K + 1): log-odds at all knots by level, the bias last.
    """
    rows, quantities = place.shape
    loss, bias = 0.0, heights.shape[1] - 1
    for r in range(rows):
        low, v = level[r], more[r]
        below, above = heights[low], heights[low + 1]
        log_odds = (1 - v) * below[bias] + v * above[bias]
        for q in range(quantities):
            k = place[r, q]
            if k >= 0:
                u = part[r, q]
                log_odds += (1 - v) * ((1 - u) * below[k] + u * below[k + 1])
                log_odds += v * ((1 - u) * above[k] + u * above[k + 1])
        true = 1.0 if together[r] else 0.0
        loss += weight[r] * (np.log1p(np.exp(-abs(log_odds))) + max(log_odds, 0.0) - true * log_odds)
        slope = weight[r] * (1 / (1 + np.exp(-log_odds)) - true)
        lower, upper = gradient[low], gradient[low + 1]
        lower[bias] += slope * (1 - v)
        upper[bias] += slope * v
        for q in range(quantities):
            k = place[r, q]
            if k >= 0:
                u = part[r, q]
                lower[k] += slope * (1 - v) * (1 - u)
                lower[k + 1] += slope * (1 - v) * u
                upper[k] += slope * v * (1 - u)
                upper[k + 1] += slope * v * u
    return loss
