"""The parameters of `group-pda`. Lengths are metres; tracking.papers.group_pda.scaled_parameters converts them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from tracking.config import param
from tracking.detect.background_settings import BackgroundSettings


@dataclass(frozen=True)
class GroupPdaConfig(BackgroundSettings):
    """The parameters of the tracker `group-pda`, with those of the background model.

    Lengths are metres. Raises InputError if a value is not allowed.
    """

    tracker: ClassVar[str] = "group-pda"

    # fmt: off
    gate: float = param(9.21, (6.0, 20.0), "", "gamma: squared Mahalanobis radius of the search region (eq. 2.2)")
    radius: float = param(0.52, (0.1, 2.0), "m",
        "from points: r of the region round a point; points nearer than 2 r are linked (R_0, sec. 3.3)", sees="points")
    person_spread: float = param(0.3, (0.05, 1.0), "m",
        "standard deviation of the prior that extents are shrunk to (ours)", "log")
    spread_weight: float = param(3.0, (0.1, 20.0), "people", "weight of that prior, in people (ours)", "log")
    accel_noise: float = param(0.5, (0.05, 5.0), "m/s^1.5",
        "standard deviation of the centroid's white acceleration, per root second", "log")
    point_noise: float = param(0.1, (0.005, 1.0), "m",
        "from points: standard deviation of a person's measured position, sensor and gait", "log", sees="points")
    extent_time: float = param(1.0, (0.05, 20.0), "s",
        "time constant of extent, number of people and colours, alpha_s and alpha_N of eq. 2.4", "log")
    count_noise: float = param(0.5, (0.05, 5.0), "people", "sigma_n of m_N: the part that does not grow with N", "log")
    association: str = param("pda", ("pda", "none"), "",
        "pda: by masses (sec. 4.2); none: all points in the region, without the constraint (sec. 5.2.1)", "categorical")
    corrections: bool = param(True, (True, False), "",
        "R, noise, extents, parts, places, hidden groups, evidence for merges: departures (c) (ours)", "categorical")
    appearance: float = param(0.5, (0.0, 5.0), "",
        "from pixels: weight of colours in the log masses (future work of sec. 6; ours)", sees="pixels")
    merge_velocity: float = param(0.5, (0.05, 3.0), "m/s",
        "groups and parts whose velocities differ by less may be one (ours, in place of SR_v)")
    merge_time: float = param(0.5, (0.0, 3.0), "s",
        "evidence at which groups merge: time for which they are near, with equal velocities (ours)")
    split_time: float = param(0.5, (0.0, 3.0), "s",
        "time without a feasible association, less the measured frames in it, after which a group falls apart")
    confirm_time: float = param(0.3, (0.0, 3.0), "s",
        "a new group is confirmed after so long with measurements, removed after so long without; parts split (ours)")
    coast_time: float = param(1.5, (0.0, 10.0), "s",
        "observed time without points after which a group is lost; `report_coast` says how long it is reported (ours)")
    report_coast: float = param(0.5, (0.0, 5.0), "s",
        "observed time after the last measurement for which a group is reported, at most `coast_time` (ours)")
    carry_time: float = param(0.9, (0.0, 3.0), "s",
        "time for which a member is expected at its predicted place; from points a missed one stands in there (ours)")
    carry_reach: float = param(0.37, (0.05, 2.0), "m",
        "from points: a member is measured if a point is so near to its predicted place (ours)", sees="points")
    pixel_radius: float = param(0.55, (0.05, 2.0), "m",
        "from pixels: r of the region round a point (R_0, sec. 3.3)", sees="pixels")
    pixel_noise: float = param(0.12, (0.005, 1.0), "m",
        "from pixels: standard deviation of one silhouette's centroid", "log", sees="pixels")
    # fmt: on
