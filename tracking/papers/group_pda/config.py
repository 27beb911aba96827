"""The parameters of `group-pda`, and the numbers of its kernels that follow from them at a frame rate and a scale."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from tracking.config import param
from tracking.detect.background_settings import BackgroundSettings


@dataclass(frozen=True)
class GroupPdaConfig(BackgroundSettings):
    """Search regions, masses, group constraint, merging, splitting and output of `group-pda`. Lengths are metres."""

    tracker: ClassVar[str] = "group-pda"

    gate: float = param(9.21, (6.0, 20.0), "", "gamma: squared Mahalanobis radius of the search region (2.2)")
    radius: float = param(
        0.52,
        (0.1, 2.0),
        "m",
        "from points: r of a point's region, those within 2 r are linked (R_0, 3.3)",
        sees="points",
    )
    person_spread: float = param(
        0.25,
        (0.05, 1.0),
        "m",
        "from points: standard deviation that the extent of few people is shrunk to (ours)",
        "log",
        sees="points",
    )
    spread_weight: float = param(3.0, (0.1, 20.0), "people", "how many people that extent counts for (ours)", "log")
    accel_noise: float = param(
        0.5, (0.05, 5.0), "m/s^1.5", "white acceleration of the centroid, per root second", "log"
    )
    point_noise: float = param(
        0.06,
        (0.005, 1.0),
        "m",
        "from points: standard deviation of one person's measured place, sensor and gait",
        "log",
        sees="points",
    )
    speed_prior: float = param(1.3, (0.1, 5.0), "m/s", "standard deviation of a newborn's velocity", "log")
    extent_time: float = param(1.0, (0.05, 20.0), "s", "time constant of the extent, alpha_s of (2.4)", "log")
    size_time: float = param(1.0, (0.05, 20.0), "s", "time constant of the number of people, alpha_N of (2.4)", "log")
    count_noise: float = param(0.5, (0.05, 5.0), "people", "sigma_n of m_N: part that does not grow with N", "log")
    count_share: float = param(0.15, (0.01, 1.0), "share", "sigma_n of m_N: part that grows with N (ours)", "log")
    detect_prob: float = param(
        0.95,
        (0.3, 1.0),
        "probability",
        "from points: that a member is measured; he is carried after that",
        sees="points",
    )
    miss_prob: float = param(0.02, (0.0, 0.5), "probability", "of the miss hypothesis before any measurement (ours)")

    association: str = param(
        "pda", ("pda", "none"), "", "masses of associations (4.2), or all points in the region (5.2.1)", "categorical"
    )
    miss: bool = param(True, (True, False), "", "an explicit hypothesis that nothing is the group's", "categorical")
    freeze: bool = param(True, (True, False), "", "extent and size rest while points are shared (ours)", "categorical")
    freeze_share: float = param(
        0.1, (0.0, 1.0), "share", "of the group's size, shared points from which on they rest (ours)"
    )
    gate_correction: bool = param(
        True, (True, False), "", "undo what the region's edge cuts from the extent (ours)", "categorical"
    )
    centroid_noise: str = param(
        "people",
        ("people", "redrawn"),
        "",
        "R of the centroid: members keep their places and some are not seen (ours), or are drawn anew each frame (2.1)",
        "categorical",
    )
    attach: bool = param(
        True,
        (True, False),
        "",
        "points in no region, but linked to a group's points, are its own (ours)",
        "categorical",
    )

    appearance: float = param(
        0.5,
        (0.0, 5.0),
        "",
        "from pixels: weight of colours among the masses (6, future work; ours)",
        before=0.0,
        sees="pixels",
    )

    merge_velocity: float = param(
        0.5, (0.05, 3.0), "m/s", "greatest difference of velocities at which groups merge (ours: SR_v made physical)"
    )
    merge_doubt: float = param(
        0.0, (0.0, 1.0), "", "standard deviations of the difference by which that is widened (ours)", before=0.0
    )
    merge_time: float = param(0.5, (0.0, 3.0), "s", "for so long groups must be near and equally fast to merge (ours)")
    split_time: float = param(
        0.5,
        (0.0, 3.0),
        "s",
        "spell without a feasible association, less the good frames in it, after which a group splits",
    )
    split_speed: float = param(
        0.5,
        (0.0, 3.0),
        "m/s",
        "standard deviation of a child's velocity about its parent's; the region widens so fast in a spell (ours)",
    )
    inherit_velocity: bool = param(
        True, (True, False), "", "children of a split start with their parent's velocity (ours)", "categorical"
    )
    confirm_time: float = param(
        0.3,
        (0.0, 3.0),
        "s",
        "a new group is told once it was measured for so long, and dies if it is not for so long (ours)",
    )
    coast_time: float = param(
        1.5, (0.0, 10.0), "s", "after so long without measurement a group claims nothing any more (ours)"
    )
    recapture: bool = param(
        True, (True, False), "", "a newborn where a lost group should be takes its id back (ours)", "categorical"
    )
    recapture_time: float = param(
        3.0, (0.0, 10.0), "s", "for so long after its last measurement a lost group waits (ours)"
    )
    report_coast: float = param(0.5, (0.0, 5.0), "s", "for so long after its last measurement a group is told (ours)")
    carry_time: float = param(
        0.9,
        (0.0, 3.0),
        "s",
        "from points: a member not measured is carried along for so long (ours)",
        before=0.0,
        sees="points",
    )
    carry_reach: float = param(
        0.37,
        (0.05, 2.0),
        "m",
        "from points: a member is measured if a point is so near his place (ours)",
        before=0.4,
        sees="points",
    )

    grid: float = param(
        0.1, (0.02, 1.0), "m", "from pixels: step of the grid of foreground points", "log", sees="pixels"
    )
    pixel_radius: float = param(0.55, (0.05, 2.0), "m", "from pixels: r of a point's region", sees="pixels")
    pixel_noise: float = param(
        0.12, (0.005, 1.0), "m", "from pixels: jitter of one silhouette's centroid", "log", sees="pixels"
    )
    least_people: float = param(
        0.25,
        (0.0, 2.0),
        "people",
        "from pixels: components of less foreground are noise (bounds the work, ours)",
        sees="pixels",
    )
    most_foreground: float = param(
        0.6,
        (0.05, 1.0),
        "share",
        "from pixels: a frame with more foreground tells nothing: lights, camera (ours)",
        sees="pixels",
    )
