"""What `joint` reports: the state estimate (sec. 4): means of the individuals and one partition for all particles."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints
from tracking.papers.joint import partition_labels_kernels


def moments(state: Array, weights: Array) -> tuple[Array, Array]:
    """Returns means (K, 4) and covariances (K, 4, 4) of states (N_x, K, 4); weights (N_x, K): sum 1 for each person."""
    mean = np.einsum("ik,ikd->kd", weights, state)
    away = state - mean
    return mean, np.einsum("ik,ikd,ike->kde", weights, away, away)


def histogram_partition(label: Ints, weights: Array) -> Ints:
    """Returns the group of each person, (K,), by the histogram of Fig. 3: each person has the label of most weight. A
    group is named by the row of its head; -1: alone."""
    votes = np.zeros((label.shape[2], label.shape[2]))
    partition_labels_kernels.head_votes(label, weights, votes)
    head = votes.argmax(axis=1)
    return np.where(np.bincount(head, minlength=len(head))[head] > 1, head, -1)
