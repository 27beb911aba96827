"""Slow, obvious forms of what `joint` computes: all partitions, the cluster validity, eq. 5."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np


def all_partitions(people: int) -> Iterator[list[list[int]]]:
    """Yields every partition of the people 0, ..., people - 1, as lists of members."""
    if people == 0:
        yield []
        return
    last = people - 1
    for smaller in all_partitions(last):
        for k in range(len(smaller)):
            yield [[*part, last] if j == k else part for j, part in enumerate(smaller)]
        yield [*smaller, [last]]


def label_of(parts: list[list[int]]) -> np.ndarray:
    """Returns the label (K,) of a partition: 0 for a person alone, else 1 + the least member."""
    label = np.zeros(sum(map(len, parts)), np.int64)
    for part in parts:
        if len(part) > 1:
            label[part] = 1 + min(part)
    return label


def validity(points: np.ndarray, parts: list[list[int]], s0: float, apart: float) -> float:
    """Returns the Davies-Bouldin index: prior scatter s0, as of one person more, and a virtual cluster at `apart`."""
    centre = [points[part].mean(axis=0) for part in parts]
    scatter = [
        (np.linalg.norm(points[part] - c, axis=1).sum() + s0) / (len(part) + 1)
        for part, c in zip(parts, centre, strict=True)
    ]
    found = []
    for g in range(len(parts)):
        ratios = [
            (scatter[g] + scatter[h]) / max(np.linalg.norm(centre[g] - centre[h]), s0)
            for h in range(len(parts)) if h != g
        ]  # fmt: skip
        found.append(max([*ratios, scatter[g] / apart]))
    return float(np.mean(found))


def log_group_dynamics(new: np.ndarray, old: np.ndarray, parts: list[list[int]], sigma: np.ndarray, dt: float) -> float:
    """Returns log p(X' | X, Z) of eq. 5; new, old (K, 4); sigma (4, 4)."""
    B = np.zeros((4, 4))
    B[0, 2] = B[1, 3] = dt
    total = 0.0
    for part in parts:
        g = old[part].mean(axis=0)
        for k in part:
            residual = new[k] - (old[k] + B @ g)
            total += -residual @ np.linalg.solve(sigma, residual) / 2 - np.log(np.linalg.det(2 * np.pi * sigma)) / 2
    return total
