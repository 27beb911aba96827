"""`adapt`: a belief for one place, from answers about some of its pairs.

The log-odds of *now* are bias + sum of terms + shift by the share of mates. Those of the place are

    bias + theta_0 + (1 + theta_1) × (terms of place) + (1 + theta_2) × (terms of motion and time) + shift,

as places differ in how many strangers are about, how near they come to each other, and how alike they walk. The shift
follows from the changed log-odds of all pairs (`mate_share`): it is computed anew for each estimate of theta. theta is
the maximum of the posterior with independent normal priors of mean 0, so that few answers change little. An answer
counts once, as the mean over its rows, and is wrong with probability 0.05, so that a slip about a sure pair does not
undo what the others say. Thresholds stay: `benchmarks labels` measured less with those of the greatest expected F1.
Log-odds of events stay, as the answers tell nothing about when groups change.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from sim.types import Array, Bools, Ints
from tracking.grouping.belief import Belief
from tracking.grouping.explained_pairs import SHARE, ExplainedPairs, quantity_of
from tracking.grouping.mate_share import MateShare

PLACE = ("distance", "sideways", "lengthwise")  # Quantities of theta_1; all others are of theta_2.
SPREAD = np.array([1.0, 0.3, 0.3])  # Standard deviations of the priors of theta; `benchmarks labels` compares others.
PRECISION = np.diag(SPREAD**-2)  # Of the prior.
SLIP = 0.05  # Probability that an answer is wrong.
ROUNDS = 20  # Estimates of theta, each with the shift that follows from those before.


@dataclass(frozen=True, slots=True, eq=False)
class Answered:
    """Rows (R,) of `ExplainedPairs` about which somebody answered."""

    row: Ints
    question: Ints  # (R,): number of the answer, from 0
    together: Bools  # (R,)


def features(pairs: ExplainedPairs) -> Array:
    """Returns the slopes (R, 3) of the log-odds in theta, at a given shift."""
    place, share = (np.isin(pairs.quantities, names) for names in (PLACE, SHARE))
    near, other = (pairs.terms[:, side].sum(axis=1, dtype=float) for side in (place, ~place & ~share))
    return np.column_stack([np.ones(len(near)), near, other])


def shift_at(pairs: ExplainedPairs, theta: Array) -> Array:
    """Returns by how much the share of mates shifts the log-odds (R,) of the belief with theta. pairs: all rows of a
    recording."""
    former = pairs.terms[:, pairs.quantities.index(SHARE)]
    log_odds, out = pairs.log_odds - former + features(pairs) @ theta, np.empty(len(pairs.step))
    order = np.argsort(pairs.step, kind="stable")
    out[order] = MateShare(pairs.belief.share).add(pairs.step[order], pairs.pair[order], log_odds[order])
    return out


def log_odds_at(pairs: ExplainedPairs, theta: Array, shift: Array) -> Array:
    """Returns the log-odds (R,) of the belief with theta, at a shift (R,)."""
    former = pairs.terms[:, pairs.quantities.index(SHARE)]
    return np.asarray(pairs.log_odds - former + shift + features(pairs) @ theta)


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
    together = np.concatenate([answers.together for _, answers in parts])
    cut = np.cumsum([0, *(answers.question[-1] + 1 for _, answers in parts)])
    question = np.concatenate([answers.question + k for (_, answers), k in zip(parts, cut, strict=False)])
    every, still = {pairs.people: pairs for pairs, _ in parts}, np.zeros(3)

    def of_answers(rows: Mapping[str, Array]) -> Array:
        return np.concatenate([rows[pairs.people][answers.row] for pairs, answers in parts])

    theta = still
    for _ in range(ROUNDS):
        shifted = {key: log_odds_at(pairs, still, shift_at(pairs, theta)) for key, pairs in every.items()}
        # halfway, as the shift follows theta_0, and full steps may go to and fro for ever
        theta = (theta + fit_theta(x, of_answers(shifted), together, question)) / 2
    found = {key: log_odds_at(pairs, theta, shift_at(pairs, theta)) for key, pairs in every.items()}
    former = {key: pairs.log_odds for key, pairs in every.items()}
    before, after = (np.bincount(question, of_answers(rows)) > 0 for rows in (former, found))
    said = np.bincount(question, together) > 0
    right = int((before == said).sum()), int((after == said).sum())
    return Adapted(changed(parts[0][0].belief, theta), theta, right, len(said))


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
