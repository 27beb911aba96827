"""The grouping function of measurements: linked points, then overlapping components (Gennari & Hager 2004, 3.3, 4.2.1).

    G_0  y_i R_0 y_j where regions of radius r round them overlap, so closer than 2 r; connected components of this
    G_x  components whose search regions (y - m)' S^-1 (y - m) < gate overlap are joined (3.1), to closure
    G_y  G_x after G_0; points satisfy the group constraint iff |G_y| = 1 (3.3)

In G_y velocities play no part: all fresh components are at rest with the same covariance. Ours: S is shrunk, (N S + n0
S0) / (N + n0) with the 1/N covariance, as one or two points have none; G_x is repeated until nothing changes, as the
region of joined components may reach one that none of them did; points may have weights (the share of a person that a
pixel is); components of less than a least weight are noise.

`prefixes` answers the group constraint for all associations of a group at once: the sets Y_ns + the first j of the
shared points grow by a point each, and so does G_0, with running sums of each component. A point costs the 20 cells
around it, and where there are M > 1 components the overlaps of all with all: n points cost O(n log n + n M^2), M being
bounded by the least weight.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.filters import components_kernels as kernels
from tracking.filters import ellipse_overlap_kernels


@dataclass(frozen=True)
class Constraint:
    """What makes points one group. link: 2 r; gate: of the search regions; prior (2, 2): S0, the covariance that few
    points are shrunk to with the weight `strength` (n0); least: weight below which a component is noise. Lengths in the
    points' unit."""

    link: float
    gate: float
    prior: Array
    strength: float
    least: float = 0.0

    @property
    def three(self) -> Array:
        """(3,) xx, xy, yy of the prior."""
        return np.array([self.prior[0, 0], self.prior[0, 1], self.prior[1, 1]])


def linked(points: Array, link: float) -> Ints:
    """G_0: (M,) the component of each point (M, 2), numbered in the order of their first points."""
    return kernels.components(points, np.ones(len(points)), link)[0]


def partition(points: Array, weights: Array, rule: Constraint) -> Ints:
    """G_y: (M,) the group of each point (M, 2), -1 noise, numbered in the order of their first points."""
    label, sums = kernels.components(points, weights, rule.link)
    parts = np.flatnonzero(sums[:, kernels.WEIGHT] >= rule.least)
    group = np.full(len(sums), -1)
    if len(parts):
        joined = kernels.closure(sums[parts], rule.gate, rule.three, rule.strength)
        group[parts] = np.unique(joined, return_inverse=True)[1]
    return np.asarray(group[label])


def prefixes(points: Array, weights: Array, start: int, rule: Constraint) -> Bools:
    """(M - start + 1,) whether the first start, start + 1, … M points (M, 2) satisfy the group constraint."""
    return kernels.prefixes(points, weights, start, rule.link, rule.gate, rule.three, rule.strength, rule.least)[0]


def regions_overlap(mean: Array, covariance: Array, gate: float) -> Bools:
    """(G, G) which of the regions of mean (G, 2), covariance (G, 2, 2) overlap each other."""
    return ellipse_overlap_kernels.overlaps(np.ascontiguousarray(mean), gate * covariance)
