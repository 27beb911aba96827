"""The numbers of `group-pda`'s kernels in the unit of the points, from its parameters, a frame rate and a scale."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.types import Array
from tracking.filters.components import Constraint
from tracking.papers.group_pda import association_kernels as kernels
from tracking.papers.group_pda.config import GroupPdaConfig

COLOURS = 64
"""Of a group's look (tracking.papers.group_pda.colour)."""


@dataclass(frozen=True)
class Rules:
    """dt, s; scale: units of the plane per metre; constraint: of G_y; numbers: `rules` of the kernels; F, Q (4, 4) of
    (2.3); noise: standard deviation of one person's measured place; pixels: are the points foreground's, not people;
    body (2, 2): covariance of one person's points; all but dt in the plane's unit. ground (2,): metres on the ground
    per unit along x and y. colours: that groups are told apart by, 0 if they are not."""

    config: GroupPdaConfig
    dt: float
    scale: float
    constraint: Constraint
    noise: float
    numbers: Array
    F: Array
    Q: Array
    pixels: bool
    ground: Array
    body: Array
    colours: int


def make_rules(
    config: GroupPdaConfig, fps: float, scale: float, person: Array | None = None, steep: float = 1.0
) -> Rules:
    """person (2, 2): covariance of one person's pixels, px^2; None: from points.
    steep: sine of the camera's tilt, by which depth is foreshortened."""
    c, dt, pixels = config, 1 / fps, person is not None
    noise = scale * (c.pixel_noise if pixels else c.point_noise)
    prior = (scale * c.person_spread) ** 2 * np.eye(2) if person is None else person
    link = 2 * scale * (c.pixel_radius if pixels else c.radius)
    cut = truncation(c.gate) if c.gate_correction else 1.0
    # Every extent is sample covariance / cut, shrunk towards `prior`: in G_y, too, or what it parts would be merged.
    least = c.least_people if pixels else 0.0
    constraint = Constraint(link, c.gate / cut, cut * prior, c.spread_weight, least)
    numbers = np.zeros(kernels.OTHERS + 1)
    numbers[kernels.GATE], numbers[kernels.LINK] = constraint.gate, link
    numbers[kernels.PRIOR_XX : kernels.PRIOR_YY + 1] = constraint.prior_entries
    numbers[kernels.STRENGTH], numbers[kernels.LEAST] = c.spread_weight, constraint.least
    numbers[kernels.NOISE], numbers[kernels.COUNT], numbers[kernels.SHARE] = noise, c.count_noise, c.count_share
    looks = 1 + c.carry_time * fps  # frames in one of which a member must be measured to be there
    numbers[kernels.DETECT] = 1.0 if pixels else 1 - (1 - c.detect_prob) ** looks
    numbers[kernels.MISS] = c.miss_prob if c.miss else 0.0
    numbers[kernels.FREEZE] = c.freeze_share if c.freeze else np.inf
    numbers[kernels.KEEP_EXTENT], numbers[kernels.KEEP_SIZE] = np.exp(-dt / np.array([c.extent_time, c.size_time]))
    numbers[kernels.CUT] = cut
    numbers[kernels.REDRAWN] = c.centroid_noise == "redrawn"
    numbers[kernels.ALL] = c.association == "none"
    numbers[kernels.OTHERS] = 1e-9 if pixels else 1.0
    if numbers[kernels.ALL]:
        numbers[kernels.MISS], numbers[kernels.FREEZE] = 0.0, np.inf
    F = np.eye(4)
    F[0, 2] = F[1, 3] = dt
    block = np.array([[dt**4 / 4, dt**3 / 2], [dt**3 / 2, dt**2]])
    Q = np.kron(block, np.eye(2)) * (scale * c.accel_noise) ** 2 / dt
    return Rules(
        config,
        dt,
        scale,
        constraint,
        noise,
        numbers,
        F,
        Q,
        pixels,
        np.array([1, 1 / steep]) / scale,
        np.zeros((2, 2)) if person is None else person,
        COLOURS if pixels and c.appearance > 0 else 0,
    )


def truncation(gate: float) -> float:
    """c: the covariance of Gaussian points inside the region is c times that of all (in the plane):
    F_chi2,4(gate) / F_chi2,2(gate)."""
    tail = np.exp(-gate / 2)
    return float((1 - tail * (1 + gate / 2)) / (1 - tail))
