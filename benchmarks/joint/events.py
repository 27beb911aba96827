"""The event classifier of `joint`, learned from simulated truth: pi(e | X, g, g'), eq. 7 of Bazzani et al. 2012.

A multinomial logistic regression over (d_KL, d_v, d_intra) of a group and its nearest one at two times EVENT_TIME
apart, as the tracker computes them. Classes are Merge, Split and None, at their natural frequency, so that the
probabilities are those of an event within that time. Rows are all groups of the true partition, people alone included,
every STRIDE. Of every WRONG-th partition there is also a wrong copy, in which a group is divided or two are joined; its
events are those that lead to the true partition, so that a filter recovers from its errors. Places and velocities have
errors as large as those of a particle.
"""

from __future__ import annotations

import argparse

import numpy as np
from scipy.optimize import minimize
from scipy.special import log_softmax

from benchmarks.support.options import seeds_text
from scenarios.loading.resolve import resolve
from sim.rng import rng
from sim.types import Array, Bools, Ints, Truth
from tracking.fitting.grouping_scenes import simulated
from tracking.papers.joint.config import EVENT_TIME
from tracking.papers.joint.group_proposal_kernels import FEATURES, partition_features
from tracking.papers.joint.partition_labels_kernels import canonical

SCENES = ("friends-meet", "friends-meet-hard")
STRIDE = 0.2  # Time between two partitions that are looked at, s.
# Standard deviations of the errors of places, m, and velocities, m/s, per axis.
ERRORS = np.array([0.05, 0.05, 0.2, 0.2])
WRONG = 20  # Of as many partitions one is also given with an error.
RIDGE = 1e-3  # Weight of the squared coefficients, of standardised features, in the loss of a row.
MERGE, SPLIT, NONE = range(3)

# Of one row for each group and time: features (R, 6), as group_proposal_kernels; what happened, (R,): MERGE, SPLIT or
# NONE; what can happen, (R, 3): one person does not split, a group without another one does not merge.
Rows = tuple[Array, Ints, Bools]


def event_rows(truth: Truth, seed: int) -> list[Rows]:
    """Returns the rows of each partition of a sequence with truth; seed: of errors of states and partitions."""
    assert truth.pos is not None
    assert truth.vel is not None
    frames, stride = max(1, round(EVENT_TIME * truth.fps)), max(1, round(STRIDE * truth.fps))
    draws, found = rng(seed, "label", 2), []
    state = np.concatenate([truth.pos, truth.vel], axis=1)
    for early in range(1, truth.length - frames + 1, stride):
        a, b = truth.rows(early), truth.rows(early + frames)
        _, i, j = np.intersect1d(truth.id[a], truth.id[b], return_indices=True)
        i, j = i + a.start, j + b.start
        before, after = (state[r] + ERRORS * draws.standard_normal((len(r), 4)) for r in (i, j))
        found.append(partition_rows(before, after, truth.group[i], truth.group[j]))
        if (early - 1) // stride % WRONG == 0 and len(i) > 1:
            copy = wrong_partition(truth.group[i], before, draws)
            found.append(partition_rows(before, after, copy, truth.group[j]))
    return found


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


def partition_rows(early: Array, late: Array, before: Ints, after: Ints) -> Rows:
    """Returns the rows of one partition, one per group and person alone. early, late (K, 4): states of the people at
    the two times; before, after (K,): their groups then, -1 alone."""
    people, label = len(before), before + 1
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
    return features[:count], event, possible


def fitted(features: Array, event: Ints, possible: Bools) -> tuple[Array, float]:
    """Returns the weights of Merge and Split (2, 7), the constant last, and the mean log loss of the rows; arguments:
    as `Rows`."""
    mean, spread = features.mean(axis=0), features.std(axis=0) + 1e-9
    design = np.concatenate([(features - mean) / spread, np.ones((len(event), 1))], axis=1)
    target = np.eye(3)[event]

    def log_loss(flat: Array, ridge: float = RIDGE / len(event)) -> tuple[float, Array]:
        weights = flat.reshape(2, FEATURES + 1)
        scores = np.concatenate([design @ weights.T, np.zeros((len(design), 1))], axis=1)
        log_p = log_softmax(np.where(possible, scores, -np.inf), axis=1)
        large = weights * (np.arange(FEATURES + 1) < FEATURES)
        slope = (np.exp(log_p) - target)[:, :NONE].T @ design / len(design) + 2 * ridge * large
        return float(ridge * (large**2).sum() - log_p[np.arange(len(design)), event].mean()), slope.ravel()

    start, options = np.zeros(2 * (FEATURES + 1)), {"maxiter": 2000}
    found = minimize(log_loss, start, jac=True, method="L-BFGS-B", options=options).x
    weights = found.reshape(2, FEATURES + 1) / np.append(spread, 1.0)
    weights[:, FEATURES] -= weights[:, :FEATURES] @ mean
    return weights, log_loss(found, 0.0)[0]


def events(given: argparse.Namespace) -> None:
    """Prints the file event_classifier.toml of tracking/papers/joint, fitted to SCENES with the seeds asked for."""
    entries = [entry for name in SCENES for entry in resolve(name)]
    parts = [rows for entry in entries for seed in given.seeds for rows in event_rows(simulated(entry, seed), seed)]
    features, event, possible = (np.concatenate(column) for column in zip(*parts, strict=True))
    weights, loss = fitted(features, event, possible)
    merges, splits, _ = np.bincount(event, minlength=3)
    print(f"# python -m benchmarks joint events --seeds {seeds_text(given.seeds)}")
    print(f"# {len(event)} rows, {merges} merges, {splits} splits, log loss {loss:.4g}")
    print('tracker = "joint"\n\n[params]')
    for name, row in zip(("merge", "split"), weights.round(4).tolist(), strict=True):
        print(f"{name}_weights = {row}")
