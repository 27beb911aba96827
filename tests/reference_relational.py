"""Slow, obvious twins of the kernels of tracking.papers.relational."""

from __future__ import annotations

import itertools

import numpy as np


def mappings(n, m):
    """All maps of n rows to at most one of m columns each, no column twice: tuples with -1 for none."""
    for choice in itertools.product(range(-1, m), repeat=n):
        taken = [j for j in choice if j >= 0]
        if len(taken) == len(set(taken)):
            yield choice


def sum_over_mappings(W, miss, spare):
    """The sum over all mappings, and the share of it that holds each pair (n, m)."""
    n, m = W.shape
    total, shares = 0.0, np.zeros((n, m))
    for choice in mappings(n, m):
        weight = 1.0
        for i, j in enumerate(choice):
            weight *= miss[i] if j < 0 else W[i, j]
        for j in set(range(m)) - set(choice):
            weight *= spare[j]
        total += weight
        for i, j in enumerate(choice):
            if j >= 0:
                shares[i, j] += weight
    return total, shares / total if total else shares
