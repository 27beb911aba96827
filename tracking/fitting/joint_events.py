"""The event classifier of `joint`, learned from simulated truth: pi(e | X, g, g'), eq. 7 of Bazzani et al. 2012.

A multinomial logistic regression over (d_KL, d_v, d_intra) of a group and its nearest one at two times a lag apart, as
the tracker computes them. Classes are Merge, Split and None, at their natural frequency, so
that the probabilities are those of an event within the lag. Rows are all groups of the true partition, people alone
included, every STRIDE. Of every WRONG-th partition there is also a wrong copy, in which a group is divided or two are
joined; its events are those that lead to the true partition, so that a filter recovers from its errors. Places and
velocities have errors as large as those of a particle.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scenarios.errors import InputError
from sim.rng import rng
from sim.types import Array, Bools, Ints, Truth
from tracking.papers.joint.group_proposal_kernels import FEATURES, partition_features
from tracking.papers.joint.partition_labels_kernels import canonical

STRIDE = 0.2  # Time between two partitions that are looked at, s.
# Standard deviations of the errors of places, m, and velocities, m/s, per axis.
PLACE_ERROR, VELOCITY_ERROR = 0.05, 0.2
WRONG = 20  # Of as many partitions one is also given with an error.
RIDGE = 1e-3  # Weight of the squared coefficients, of standardised features, in the loss of a row.
LEAST = 5  # Fewest merges, and splits, from which a classifier is fitted.
MERGE, SPLIT, NONE = range(3)
CLASSES = ("merge", "split", "none")


@dataclass(frozen=True)
class EventRows:
    """Groups and what happened to them within the lag, one row for each group and time."""

    features: Array  # (R, 6): as group_proposal_kernels
    event: Ints  # (R,): MERGE, SPLIT or NONE
    possible: Bools  # (R, 3): one person does not split, a group without another one does not merge

    @classmethod
    def joined(cls, parts: Iterable[EventRows]) -> EventRows:
        """Returns the rows of all parts as one `EventRows`, in order."""
        given = [*parts, cls(np.zeros((0, FEATURES)), np.zeros(0, np.int64), np.zeros((0, 3), bool))]
        return cls(*(np.concatenate([getattr(p, name) for p in given]) for name in ("features", "event", "possible")))


def event_rows(truth: Truth, lag: float, seed: int) -> EventRows:
    """Returns the rows of a sequence with truth. lag: time between the two moments of the features, s; seed: of the
    random errors of positions, velocities and partitions."""
    assert truth.pos is not None
    assert truth.vel is not None
    frames, stride = max(1, round(lag * truth.fps)), max(1, round(STRIDE * truth.fps))
    draws, found = rng(seed, "label", 2), []
    for early in range(1, truth.length - frames + 1, stride):
        a, b = truth.rows(early), truth.rows(early + frames)
        _, i, j = np.intersect1d(truth.id[a], truth.id[b], return_indices=True)
        i, j = i + a.start, j + b.start
        states = [_erring(np.concatenate([truth.pos[r], truth.vel[r]], axis=1), draws) for r in (i, j)]
        found.append(partition_rows(states[0], states[1], truth.group[i], truth.group[j]))
        if (early - 1) // stride % WRONG == 0 and len(i) > 1:
            copy = wrong_partition(truth.group[i], states[0], draws)
            found.append(partition_rows(states[0], states[1], copy, truth.group[j]))
    return EventRows.joined(found)


def wrong_partition(group: Ints, state: Array, draws: np.random.Generator) -> Ints:
    """Returns a copy of the groups (K,), -1 alone, with a random error: a part leaves a group, or the two nearest
    groups (or people alone) are joined. state (K, 4): position and velocity of each person."""
    out, new = group.copy(), group.max(initial=0) + 1
    named = np.unique(group[group >= 0])
    if len(named) and draws.random() < 0.5:
        members = draws.permutation(np.flatnonzero(group == draws.choice(named)))
        part = members[: 1 if draws.random() < 0.5 else len(members) // 2]
        out[part] = new if len(part) > 1 else -1
        rest = members[len(part) :]
        out[rest] = out[rest] if len(rest) > 1 else -1
        return out
    apart = np.hypot(*(state[:, None, :2] - state[None, :, :2]).transpose(2, 0, 1))
    apart[(group[:, None] == group) & (group >= 0)] = np.inf
    np.fill_diagonal(apart, np.inf)
    a, b = np.unravel_index(int(apart.argmin()), apart.shape)
    if np.isfinite(apart[a, b]):
        joined = [(group == group[k]) if group[k] >= 0 else np.arange(len(group)) == k for k in (a, b)]
        out[joined[0] | joined[1]] = new
    return out


def _erring(state: Array, draws: np.random.Generator) -> Array:
    spread = np.array([PLACE_ERROR, PLACE_ERROR, VELOCITY_ERROR, VELOCITY_ERROR])
    return np.asarray(state + spread * draws.standard_normal(state.shape))


def partition_rows(early: Array, late: Array, before: Ints, after: Ints) -> EventRows:
    """Returns the rows of one partition, one per group and person alone. early, late (K, 4): states of the people at
    the two moments; before, after (K,): their groups then, -1 alone."""
    people = len(before)
    label = before + 1
    canonical(label)
    features, (nearest, cluster, head) = np.empty((people, FEATURES)), np.empty((3, people), np.int64)
    count = partition_features(early, late, label, features, nearest, cluster, head, np.empty((people, 9)))
    event, possible = np.full(count, NONE), np.ones((count, 3), bool)
    members = [np.flatnonzero(cluster == g) for g in range(count)]
    for g in range(count):
        own, other = after[members[g]], nearest[g]
        possible[g] = other >= 0, len(own) > 1, True
        if len(own) > 1 and (own.min() < 0 or own.min() != own.max()):
            event[g] = SPLIT
        elif other >= 0 and own[0] >= 0 and (after[members[other]] == own[0]).any():
            event[g] = MERGE
    return EventRows(features[:count], event, possible)


def fit_events(rows: EventRows) -> dict[str, list[float]]:
    """Returns the weights of Merge and Split by the names of the config, merge_weights and split_weights."""
    from scipy.optimize import minimize

    counts = np.bincount(rows.event, minlength=3)
    if counts[:NONE].min() < LEAST:
        raise InputError(
            place="scenes", got=f"{counts[MERGE]} merges, {counts[SPLIT]} splits", expected=f"{LEAST} of each",
            remedy="give more seeds or scenarios with events",
        )  # fmt: skip
    mean, spread = rows.features.mean(axis=0), rows.features.std(axis=0) + 1e-9
    design = np.concatenate([(rows.features - mean) / spread, np.ones((len(rows.event), 1))], axis=1)
    target = np.eye(3)[rows.event]

    def loss(flat: Array) -> tuple[float, Array]:
        weights = flat.reshape(2, FEATURES + 1)
        log_p = _log_probabilities(design, weights, rows.possible)
        error = (np.exp(log_p) - target)[:, :NONE]
        ridge = weights.copy()
        ridge[:, -1] = 0.0
        gradient = error.T @ design / len(design) + RIDGE / len(design) * 2 * ridge
        value = -log_p[np.arange(len(design)), rows.event].mean() + RIDGE / len(design) * (ridge**2).sum()
        return float(value), gradient.ravel()

    found = minimize(loss, np.zeros(2 * (FEATURES + 1)), jac=True, method="L-BFGS-B", options={"maxiter": 2000})
    weights = found.x.reshape(2, FEATURES + 1)
    weights[:, :FEATURES] /= spread
    weights[:, FEATURES] -= weights[:, :FEATURES] @ mean
    return {f"{CLASSES[event]}_weights": weights[event].round(4).tolist() for event in (MERGE, SPLIT)}


def log_probabilities(rows: EventRows, weights: Mapping[str, Sequence[float]]) -> Array:
    """Returns log pi(e | X, g, g') of the events Merge, Split and None, in this order, (R, 3); -inf if impossible."""
    table = np.array([weights[f"{CLASSES[event]}_weights"] for event in (MERGE, SPLIT)])
    design = np.concatenate([rows.features, np.ones((len(rows.event), 1))], axis=1)
    return _log_probabilities(design, table, rows.possible)


def _log_probabilities(design: Array, weights: Array, possible: Bools) -> Array:
    from scipy.special import log_softmax

    scores = np.concatenate([design @ weights.T, np.zeros((len(design), 1))], axis=1)
    return np.asarray(log_softmax(np.where(possible, scores, -np.inf), axis=1))


def event_scores(rows: EventRows, weights: Mapping[str, Sequence[float]]) -> dict[str, float]:
    """Returns by name the numbers of "rows", "merges" and "splits", the mean "log_loss" of a classifier with these
    weights, and "prior_log_loss", that of the overall shares of the events."""
    counts, each = np.bincount(rows.event, minlength=3), np.arange(len(rows.event))
    prior = np.where(rows.possible, np.maximum(counts / max(len(rows.event), 1), 1e-12), 0.0)
    prior /= prior.sum(axis=1, keepdims=True)
    return {
        "rows": float(len(rows.event)), "merges": float(counts[MERGE]), "splits": float(counts[SPLIT]),
        "log_loss": -float(log_probabilities(rows, weights)[each, rows.event].mean()),
        "prior_log_loss": -float(np.log(prior[each, rows.event]).mean()),
    }  # fmt: skip
