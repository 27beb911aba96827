"""Colours as a further mass of `group-pda`'s associations, from pixels only (future work of sec. 6; the form is ours).

The mass of an association is the relative weight of a set of points as the measurement of a group.

Each group has a histogram of the colours of its unshared points. A shared point of colour c adds `appearance` times
log p(c | g) - log p(c | the other groups that may have the point) to the log mass of group g's associations, where
p(c | g), the probability of colour c in group g, comes from the smoothed histograms. It counts as the share of a person
that the point stands for, because neighbouring pixels have like colours.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Image, Ints
from tracking.papers.group_pda.group_bank import GroupBank
from tracking.papers.group_pda.scaled_parameters import COLOUR_BINS, ScaledParameters

LEVELS = 4  # Levels of each of the three channels: LEVELS cubed is COLOUR_BINS.
SMOOTHING = 0.05  # People, spread evenly over all bins, that are added to a histogram.


def colour_bins(image: Image, points: Array) -> Ints:
    """Returns the colour histogram bin (M,), 0 to 63, of the pixel at each point (M, 2) u, v in px: blue + 4 green + 16
    red, 4 levels each."""
    u, v = points.astype(np.int64).T
    level = image[v, u].astype(np.int64) * LEVELS // 256
    return np.asarray(level @ np.array([1, LEVELS, LEVELS**2]))


def colour_density(bank: GroupBank, bins: Ints) -> Array:
    """Returns the probability (G, M) of each point's colour among the people of each group."""
    smooth = (bank.colour_hist + SMOOTHING / COLOUR_BINS) / (bank.colour_hist.sum(1, keepdims=True) + SMOOTHING)
    return np.asarray(smooth[:, bins])


def update_histograms(
    bank: GroupBank, chosen: Bools, claimants: Ints, bins: Ints, weights: Array, scaled: ScaledParameters
) -> None:
    """Updates the groups' colour histograms (in the bank) in place by their points that no other group may have."""
    keep = np.exp(-scaled.dt / scaled.config.extent_time)
    for row in np.flatnonzero(chosen.any(1)).tolist():
        mine = chosen[row] & (claimants < 2)
        if mine.any():
            new = np.bincount(bins[mine], weights[mine], COLOUR_BINS)
            old = bank.colour_hist[row]
            bank.colour_hist[row] = keep * old + (1 - keep) * new if old.any() else new
