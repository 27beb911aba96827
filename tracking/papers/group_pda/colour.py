"""Colours as a further mass of `group-pda`'s associations (6, future work; the form is ours), from pixels.

A group's look is a histogram of the colours of its unshared points. A shared point of colour c speaks for group g with
log p(c | g) - log p(c | the others that may have it), in which the looks are smoothed histograms; an association has
the sum over its shared points, each counted as the share of a person that it is, as neighbours are coloured alike.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Image, Ints
from tracking.papers.group_pda.group_bank import Bank
from tracking.papers.group_pda.kernel_parameters import COLOURS, Rules

LEVELS = 4
"""Per channel; COLOURS is its cube."""
SMOOTH = 0.05
"""People of every colour that are added to a look."""


def colours(image: Image, points: Array) -> Ints:
    """(M,) the colour, 0 … COLOURS - 1, of the pixels at points (M, 2)."""
    u, v = points.astype(np.int64).T
    level = image[v, u].astype(np.int64) * LEVELS // 256
    return np.asarray(level @ np.array([1, LEVELS, LEVELS**2]))


def speaks(bank: Bank, d2: Array, colour: Ints) -> Array:
    """(G, M) how much a shared point's colour speaks for each group that may have it; 0 elsewhere."""
    spoken, may = np.zeros(d2.shape), np.isfinite(d2)
    count = may.sum(0)
    shared = np.flatnonzero(count > 1)
    if not len(shared):
        return spoken
    look = (bank.look + SMOOTH / COLOURS) / (bank.look.sum(1, keepdims=True) + SMOOTH)
    may = may[:, shared]
    p = np.where(may, look[:, colour[shared]], 0.0)
    others = np.where(may, (p.sum(0) - p) / (count[shared] - 1), 1.0)
    spoken[:, shared] = np.log(np.where(may, p, 1.0)) - np.log(others)
    return spoken


def learn(bank: Bank, chosen: Bools, hits: Ints, colour: Ints, weights: Array, rules: Rules) -> None:
    """The groups' looks, from those of their points (G, M) that no other may have, forgotten like the extent."""
    keep = np.exp(-rules.dt / rules.config.extent_time)
    for row in np.flatnonzero(chosen.any(1)).tolist():
        mine = chosen[row] & (hits < 2)
        if mine.any():
            new = np.bincount(colour[mine], weights[mine], COLOURS)
            bank.look[row] = keep * bank.look[row] + (1 - keep) * new if bank.look[row].any() else new
