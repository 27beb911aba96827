"""The state estimate (sec. 4): means of the individuals, and one partition for all particles."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.papers.joint import partition_kernels


def moments(state: Array, weights: Array) -> tuple[Array, Array]:
    """Returns means (K, 4) and covariances (K, 4, 4) of states (N_x, K, 4); weights (N_x, K): sum 1 for each person."""
    mean = np.einsum("ik,ikd->kd", weights, state)
    away = state - mean
    return mean, np.einsum("ik,ikd,ike->kde", weights, away, away)


def kept_while_missed(now: Array, id: Ints, seen: Bools, before: Array, before_id: Ints) -> Array:
    """Returns the probability that each pair is in one group, (K, K), which stays while one of the two is not measured
    (ours)."""
    out = now.copy()
    _, new, old = np.intersect1d(id, before_id, assume_unique=True, return_indices=True)
    rows, both = np.ix_(new, new), seen[new][:, None] & seen[new]
    out[rows] = np.where(both, now[rows], before[np.ix_(old, old)])
    return out


def binder_partition(together: Array, label: Ints, before: Ints) -> list[Ints]:
    """Returns the groups of two or more people, as arrays of rows: the partition of least expected Binder loss
    (ours)."""
    gain = together - 0.5
    sampled = np.empty(len(together), np.int64)
    partition_kernels.best_sampled(gain, label, sampled)
    starts = [sampled, _numbered(before)]
    gains = [partition_kernels.binder_moves(gain, start) for start in starts]
    return groups_of(starts[int(np.argmax(gains))])


def histogram_partition(label: Ints, weights: Array) -> list[Ints]:
    """Returns the groups of two or more people by the histogram of Fig. 3: each person has the label of most weight."""
    votes = np.empty((label.shape[2], label.shape[2]))
    partition_kernels.head_votes(label, weights, votes)
    return groups_of(votes.argmax(axis=1))


def groups_of(label: Ints) -> list[Ints]:
    """Returns the rows of each label (K,) that two or more people carry."""
    found = (np.flatnonzero(label == g) for g in np.unique(label))
    return [rows for rows in found if len(rows) > 1]


def _numbered(group: Ints) -> Ints:
    alone = group < 0
    named = np.where(alone, group.max(initial=0) + 1 + np.arange(len(group)), group)
    return np.asarray(np.unique(named, return_inverse=True)[1] + 1)
