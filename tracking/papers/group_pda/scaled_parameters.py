"""The parameters of `group-pda` in the unit of the points (m or px) and per frame, with the `rules` of the kernels."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from sim.types import Array
from tracking.filters import kalman
from tracking.filters.components import Constraint
from tracking.papers.group_pda import association_mass_kernels as kernels
from tracking.papers.group_pda.config import GroupPdaConfig

SPEED_PRIOR = 1.3  # m/s: standard deviation of a newborn group's velocity, per axis, that of walking people.
LEAST_PEOPLE = 0.25  # From pixels: components with less foreground, in people, are noise (ours).
COLOUR_BINS = 64  # Bins of a group's colour histogram (tracking.papers.group_pda.colours).


@dataclass(frozen=True)
class ScaledParameters:
    """The parameters of `group-pda` per frame; lengths are in the unit of the points: m on the ground, px in the image.

    config: the GroupPdaConfig they come from. dt: s between frames. scale: units per metre (1 on the ground).
    constraint: the rule G_y by which points are one group (sec. 3.3). point_sd: standard deviation of one person's
    measured position. kernel_rules (14,): the array `rules` of the kernels (gates, priors, noises). F, Q (4, 4):
    transition and process noise covariance of x, y, vx, vy, eq. 2.3. from_pixels: True if the points are foreground
    pixels, not people. metres_per_unit (2,): metres on the ground per unit along x and along y (depth in an image).
    colour_bins: bins of colour histograms (64), 0 if colours are not used.
    """

    config: GroupPdaConfig
    dt: float
    scale: float
    constraint: Constraint
    point_sd: float
    kernel_rules: Array
    F: Array
    Q: Array
    from_pixels: bool
    metres_per_unit: Array
    colour_bins: int


@lru_cache(maxsize=16)
def scale_parameters(
    config: GroupPdaConfig, fps: float, scale: float, sine_tilt: float = 1.0, pixels: bool = False
) -> ScaledParameters:
    """Returns the parameters for a frame rate `fps` (frames per s) and a scale in units of the points per metre."""
    c, dt = config, 1 / fps
    point_sd = scale * (c.pixel_noise if pixels else c.point_noise)
    prior = (scale * c.person_spread) ** 2 * np.eye(2)
    link = 2 * scale * (c.pixel_radius if pixels else c.radius)
    factor = gate_factor(c.gate) if c.corrections else 1.0
    least = LEAST_PEOPLE if pixels and c.corrections else 0.0
    # Every extent is (sample covariance shrunk towards `prior`) / factor. G_y must use the same extents: otherwise
    # groups that it separates would be merged again.
    constraint = Constraint(link, c.gate / factor, factor * prior, c.spread_weight, least)
    F, Q = kalman.constant_velocity(dt, 2)
    return ScaledParameters(
        config=config,
        dt=dt,
        scale=scale,
        constraint=constraint,
        point_sd=point_sd,
        kernel_rules=_kernel_rules(c, fps, constraint, point_sd, factor, pixels),
        F=F,
        Q=Q * (scale * c.accel_noise) ** 2 / dt,
        from_pixels=pixels,
        metres_per_unit=np.array([1, 1 / sine_tilt]) / scale,
        colour_bins=COLOUR_BINS if pixels and c.appearance > 0 else 0,
    )


def _kernel_rules(
    c: GroupPdaConfig, fps: float, constraint: Constraint, point_sd: float, factor: float, pixels: bool
) -> Array:
    rules = np.zeros(kernels.RULES)
    rules[kernels.GATE], rules[kernels.LINK] = constraint.gate, constraint.link
    rules[kernels.PRIOR_XX : kernels.PRIOR_YY + 1] = constraint.prior_entries
    rules[kernels.PRIOR_WEIGHT], rules[kernels.LEAST_WEIGHT] = c.spread_weight, constraint.least
    rules[kernels.POINT_SD] = point_sd
    rules[kernels.COUNT_SD] = c.count_noise
    rules[kernels.KEEP] = np.exp(-1 / fps / c.extent_time)
    rules[kernels.GATE_FACTOR] = factor
    rules[kernels.REDRAWN] = not c.corrections
    rules[kernels.UNCONSTRAINED] = c.association == "none"
    rules[kernels.LEAST_OTHERS] = 1e-9 if pixels else 1.0
    return rules


def gate_factor(gate: float) -> float:
    """Returns c, below 1: Gaussian points in the plane that lie within the gate have c times the covariance of all
    points."""
    tail = np.exp(-gate / 2)
    return float((1 - tail * (1 + gate / 2)) / (1 - tail))
