"""Components of points: linked points, and components with overlapping search regions (Gennari & Hager 2004).

The grouping function of measurements (sec. 3.3, 4.2.1), which `group-pda` and its kernels use:
    G_0  points y_i, y_j are linked (y_i R_0 y_j) if regions of radius r round them overlap: at most 2 r apart;
         G_0 are the connected components
    G_x  components whose search regions (y - m)' S^-1 (y - m) < gate overlap are joined (sec. 3.1); m is a component's
         mean, S its covariance, gate a squared Mahalanobis radius
    G_y  G_x of the components of G_0; points satisfy the group constraint if |G_y| = 1 (sec. 3.3)
In G_y velocities have no part: all fresh components are at rest with the same covariance.

Ours: S is shrunk to (N S + n0 S0) / (N + n0), as one or two points have none. N is the component's weight, S its
covariance with 1/N, S0 a prior covariance and n0 the prior's weight. G_x is repeated until nothing changes, since the
region of joined components may overlap one that none of them did. Points have weights (the share of a person that a
pixel is). A component below a least weight is noise. Regions that only touch overlap; those of eq. 2.2 have no border.
Gennari & Hager do not say how they test for overlap: see components_kernels.overlap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.filters import components_kernels as kernels


@dataclass(frozen=True)
class Constraint:
    """The rule by which points are one group; lengths in the points' unit (m or px)."""

    link: float  # 2 r, largest distance of linked points, above 0
    gate: float  # squared Mahalanobis radius of the search region of a component (set of linked points)
    prior: Array  # (2, 2): S0, the covariance (squared unit) to which a component's covariance S is shrunk
    strength: float  # n0, the weight of S0, in units of the points' weights
    least: float = 0.0  # a component whose points have less total weight is noise; 0 (default): none is

    @property
    def prior_entries(self) -> Array:
        """Entries xx, xy, yy of the prior covariance, (3,), squared unit of the points."""
        return np.array([self.prior[0, 0], self.prior[0, 1], self.prior[1, 1]])


def linked(points: Array, link: float) -> Ints:
    """Returns the number of each point's connected component, (M,), in order of first points. Two points are connected
    if they are at most `link` apart, directly or through other points."""
    return kernels.components(points, np.ones(len(points)), link)[0]


def partition(points: Array, weights: Array, rule: Constraint) -> Ints:
    """Returns the group of each point (M,), numbered in order of first points; -1 for noise."""
    label, sums = kernels.components(points, weights, rule.link)
    parts = np.flatnonzero(sums[:, kernels.WEIGHT] >= rule.least)
    group = np.full(len(sums), -1)
    if len(parts):
        # noise must not bridge two groups, so that only the heavy components are joined
        joined = kernels.closure(sums[parts], rule.gate, rule.prior_entries, rule.strength)
        group[parts] = np.unique(joined, return_inverse=True)[1]
    return np.asarray(group[label])


def regions_overlap(mean: Array, covariance: Array, gate: float) -> Bools:
    """Returns flags (G, G): True where two regions (y - mean)' covariance^-1 (y - mean) <= gate overlap or touch."""
    return kernels.overlaps(np.ascontiguousarray(mean), gate * covariance)
