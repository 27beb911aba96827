"""`adapt`: a belief for one place, from answers about some of its pairs.

The log-odds of *now* are bias + sum of terms. Those of the place are

    bias + theta_0 + (1 + theta_1) × (terms of place) + (1 + theta_2) × (terms of motion and time),

as places differ in how many strangers are about, how near they come to each other, and how alike they walk. theta is
the maximum of the posterior with independent normal priors of mean 0, so that few answers change little. An answer
counts once, as the mean over its rows, and is wrong with probability 0.05, so that a slip about a sure pair does not
undo what the others say. The threshold has the greatest expected F1 over all pairs of the recording.
Log-odds of events stay, as the answers tell nothing about when groups change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from sim.types import Array, Bools, Ints
from tracking.fitting.belief import THRESHOLDS
from tracking.grouping.belief import Belief
from tracking.grouping.explained_pairs import ExplainedPairs, quantity_of

PLACE = ("distance", "sideways", "lengthwise")  # Quantities of theta_1; all others are of theta_2.
SPREAD = np.array([1.0, 0.3, 0.3])  # Standard deviations of the priors of theta; `benchmarks labels` compares others.
PRECISION = np.diag(SPREAD**-2)  # Of the prior.
SLIP = 0.05  # Probability that an answer is wrong.


@dataclass(frozen=True, slots=True, eq=False)
class Answered:
    """Rows (R,) of `ExplainedPairs` about which somebody answered."""

    row: Ints
    question: Ints  # (R,): number of the answer, from 0
    together: Bools  # (R,)


def features(pairs: ExplainedPairs) -> Array:
    """Returns the slopes (R, 3) of the log-odds in theta."""
    place = np.isin(pairs.quantities, PLACE)
    near, other = (pairs.terms[:, side].sum(axis=1, dtype=float) for side in (place, ~place))
    return np.column_stack([np.ones(len(near)), near, other])


@dataclass(frozen=True, slots=True, eq=False)
class Adapted:
    """A belief for one place, and how it was found."""

    belief: Belief
    theta: Array  # (3,)
    right: tuple[int, int]  # answers with which the former and the adapted belief agree, by their mean log-odds
    count: int  # answers


def adapt(parts: Sequence[tuple[ExplainedPairs, Answered]]) -> Adapted:
    """Returns the belief of the evidence, adapted to the answers. parts: evidence and answers about each recording, or
    several about one; with at least one answer, and all by one belief."""
    x = np.concatenate([features(pairs)[answers.row] for pairs, answers in parts])
    log_odds = np.concatenate([pairs.log_odds[answers.row] for pairs, answers in parts])
    together = np.concatenate([answers.together for _, answers in parts])
    cut = np.cumsum([0, *(answers.question[-1] + 1 for _, answers in parts)])
    question = np.concatenate([answers.question + k for (_, answers), k in zip(parts, cut, strict=False)])
    theta = fit_theta(x, log_odds, together, question)
    belief = changed(parts[0][0].belief, theta)
    every = {pairs.people: pairs for pairs, _ in parts}.values()
    threshold = expected_threshold(np.concatenate([pairs.log_odds + features(pairs) @ theta for pairs in every]))
    before, after = (np.bincount(question, z) > 0 for z in (log_odds, log_odds + x @ theta))
    said = np.bincount(question, together) > 0
    right = int((before == said).sum()), int((after == said).sum())
    belief = replace(belief, threshold=np.full(len(belief.noise), threshold))
    return Adapted(belief, theta, right, len(said))


def fit_theta(x: Array, log_odds: Array, together: Bools, question: Ints) -> Array:
    """Returns theta (3,) of the greatest posterior. x (R, 3): slopes; log_odds, together, question (R,): of rows."""
    weight, sign = 1 / np.bincount(question)[question], np.where(together, 1.0, -1.0)

    def objective(theta: Array) -> tuple[float, Array]:
        right = 1 / (1 + np.exp(-sign * (log_odds + x @ theta)))
        likelihood = SLIP + (1 - 2 * SLIP) * right
        slope = (1 - 2 * SLIP) * right * (1 - right) * sign / likelihood
        loss = -weight @ np.log(likelihood) + theta @ PRECISION @ theta / 2
        return float(loss), PRECISION @ theta - x.T @ (weight * slope)

    return np.asarray(minimize(objective, np.zeros(len(SPREAD)), jac=True, method="BFGS").x)


def changed(belief: Belief, theta: Array) -> Belief:
    """Returns the belief with theta in its bias and tables, for now."""
    factor = {True: 1 + theta[1], False: 1 + theta[2]}
    tables = tuple(
        replace(t, log_odds=np.stack([factor[quantity_of(t.name) in PLACE] * t.log_odds[0], t.log_odds[1]]))
        for t in belief.tables
    )
    return replace(belief, bias=np.stack([belief.bias[0] + theta[0], belief.bias[1]]), tables=tables)


def expected_threshold(log_odds: Array) -> float:
    """Returns the threshold at which the expected F1 of R rows is greatest, if their probabilities are right: twice the
    expected hits over the rows above it and the expected number of mates. Of several the middle."""
    probability = 1 / (1 + np.exp(-log_odds))
    place = (THRESHOLDS * probability).astype(np.int64).clip(0, THRESHOLDS - 1)
    hits, rows = (np.bincount(place, w, THRESHOLDS)[::-1].cumsum()[::-1] for w in (probability, None))
    f1 = 2 * hits / np.maximum(rows + probability.sum(), 1e-9)
    best = np.flatnonzero(f1 >= f1.max() - 1e-12)
    return float(best[len(best) // 2]) / THRESHOLDS
