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


def relations(particles):
    """The relations of all pairs, (P, K, K), symmetric."""
    made = np.zeros((particles.count, particles.people, particles.people), bool)
    for (i, j), row in zip(particles.pairs.tolist(), particles.related, strict=True):
        made[:, i, j] = made[:, j, i] = row
    return made


def relate(particles, i, j, where=True):
    """Sets in which particles people i and j walk together; where (P,) bool, or one bool for all."""
    particles.hold(np.array([sorted((i, j))]))
    row = np.flatnonzero((particles.pairs == sorted((i, j))).all(axis=1))[0]
    particles.related[row] = where


def drawn(particles, rng):
    """Uniform numbers for `resample`, from one generator."""
    return lambda people: rng.random((len(people), particles.count))
