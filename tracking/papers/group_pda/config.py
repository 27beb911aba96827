"""The parameters of `group-pda`. Lengths are metres; tracking.papers.group_pda.scaled_parameters converts them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from tracking.config import param
from tracking.detect.background_settings import BackgroundSettings


@dataclass(frozen=True)
class GroupPdaConfig(BackgroundSettings):
    """The parameters of the tracker `group-pda`, with those of the background model; each field states default, range
    and unit.

    Lengths are metres. They are search regions, masses of associations, group constraint, merging, splitting,
    confirmation, reporting and, from pixels, the grid of points. Raises InputError if a value is not allowed or
    foreground_time is shorter than background_time.
    """

    tracker: ClassVar[str] = "group-pda"

    gate: float = param(9.21, (6.0, 20.0), "", "gamma: squared Mahalanobis radius of the search region (eq. 2.2)")
    radius: float = param(
        0.52,
        (0.1, 2.0),
        "m",
        "from points: r of the region round a point; points nearer than 2 r are linked (R_0, sec. 3.3)",
        sees="points",
    )
    person_spread: float = param(
        0.25,
        (0.05, 1.0),
        "m",
        "from points: standard deviation of the prior that extents are shrunk to (ours)",
        "log",
        sees="points",
    )
    spread_weight: float = param(3.0, (0.1, 20.0), "people", "weight of that prior, in people (ours)", "log")
    accel_noise: float = param(
        0.5, (0.05, 5.0), "m/s^1.5", "standard deviation of the centroid's white acceleration, per root second", "log"
    )
    point_noise: float = param(
        0.06,
        (0.005, 1.0),
        "m",
        "from points: standard deviation of one person's measured position, from sensor and gait",
        "log",
        sees="points",
    )
    speed_prior: float = param(1.3, (0.1, 5.0), "m/s", "standard deviation of a newborn group's velocity", "log")
    extent_time: float = param(1.0, (0.05, 20.0), "s", "time constant of the extent, alpha_s of eq. 2.4", "log")
    size_time: float = param(1.0, (0.05, 20.0), "s", "time constant of the number of people, alpha_N of eq. 2.4", "log")
    count_noise: float = param(0.5, (0.05, 5.0), "people", "sigma_n of m_N: the part that does not grow with N", "log")
    count_share: float = param(
        0.15, (0.01, 1.0), "share", "sigma_n of m_N: the part that grows with N, per N (ours)", "log"
    )
    detect_prob: float = param(
        0.95,
        (0.3, 1.0),
        "probability",
        "from points: that a member is measured in a frame; without carry_time it tells how many members are unseen",
        sees="points",
    )
    miss_prob: float = param(0.02, (0.0, 0.5), "probability", "prior probability of the miss hypothesis (ours)")

    association: str = param(
        "pda",
        ("pda", "nearest", "all", "none"),
        "",
        "pda: associations by their masses (sec. 4.2); nearest: shared points go to the most probable group; all: all "
        "points in the region; none: all points, without group constraint (sec. 5.2.1)",
        "categorical",
    )
    miss: bool = param(True, (True, False), "", "use a hypothesis that no point is the group's (ours)", "categorical")
    freeze: bool = param(
        True,
        (True, False),
        "",
        "extent and size do not change while many points may be another group's (ours)",
        "categorical",
    )
    freeze_share: float = param(
        0.1,
        (0.0, 1.0),
        "share",
        "people among a group's points who are another group's, per group size, above which extent and size do not "
        "change (ours)",
    )
    gate_correction: bool = param(
        True,
        (True, False),
        "",
        "restore the part of the extent that the edge of the region cuts off (ours)",
        "categorical",
    )
    centroid_noise: str = param(
        "people",
        ("people", "redrawn"),
        "",
        "R of the centroid; people: members keep their places, some are not seen (ours); redrawn: as in eq. 2.1",
        "categorical",
    )
    attach: bool = param(
        True,
        (True, False),
        "",
        "points in no region that are linked to a group's points belong to the group (ours)",
        "categorical",
    )

    appearance: float = param(
        0.5,
        (0.0, 5.0),
        "",
        "from pixels: weight of colours in the log masses (future work of sec. 6; ours)",
        sees="pixels",
    )

    merge_velocity: float = param(
        0.5, (0.05, 3.0), "m/s", "largest difference of velocities at which groups merge (ours, in place of SR_v)"
    )
    merge_doubt: float = param(
        0.0,
        (0.0, 1.0),
        "",
        "standard deviations of the difference that are added to merge_velocity (ours)",
    )
    merge_time: float = param(
        0.5, (0.0, 3.0), "s", "time for which groups must be near with like velocities before they merge (ours)"
    )
    split_time: float = param(
        0.5,
        (0.0, 3.0),
        "s",
        "time without a feasible association, less the measured frames in it, after which a group splits",
    )
    split_speed: float = param(
        0.5,
        (0.0, 3.0),
        "m/s",
        "standard deviation of a child's velocity about its parent's, and speed at which a group's region widens "
        "while it has no feasible association (ours)",
    )
    inherit_velocity: bool = param(
        True, (True, False), "", "children of a split start with their parent's velocity (ours)", "categorical"
    )
    confirm_time: float = param(
        0.3,
        (0.0, 3.0),
        "s",
        "a new group is confirmed after so long with measurements and removed after so long without (ours)",
    )
    coast_time: float = param(
        1.5, (0.0, 10.0), "s", "time without a measurement after which a group is lost and claims no points (ours)"
    )
    recapture: bool = param(
        True,
        (True, False),
        "",
        "a newborn group that fits a group not measured now takes its id over (ours)",
        "categorical",
    )
    recapture_time: float = param(
        3.0, (0.0, 10.0), "s", "time after the last measurement for which a lost group's id can be taken over (ours)"
    )
    report_coast: float = param(
        0.5, (0.0, 5.0), "s", "time after the last measurement for which a group is reported (ours)"
    )
    carry_time: float = param(
        0.9,
        (0.0, 3.0),
        "s",
        "from points: time for which a missed member stands in at its predicted place; from both: a new group near a "
        "member measured so lately is its group's child (ours)",
        sees="points",
    )
    carry_reach: float = param(
        0.37,
        (0.05, 2.0),
        "m",
        "from points: a member is measured if a point is within this distance of its predicted place (ours)",
        sees="points",
    )

    grid: float = param(0.1, (0.02, 1.0), "m", "from pixels: distance of the grid's points", "log", sees="pixels")
    pixel_radius: float = param(
        0.55, (0.05, 2.0), "m", "from pixels: r of the region round a point (R_0, sec. 3.3)", sees="pixels"
    )
    pixel_noise: float = param(
        0.12, (0.005, 1.0), "m", "from pixels: standard deviation of one silhouette's centroid", "log", sees="pixels"
    )
    least_people: float = param(
        0.25,
        (0.0, 2.0),
        "people",
        "from pixels: components with less foreground are noise (ours)",
        sees="pixels",
    )
    most_foreground: float = param(
        0.6,
        (0.05, 1.0),
        "share",
        "from pixels: a frame with a larger share of foreground is ignored (ours)",
        sees="pixels",
    )
