"""The parameters of `stereo`. Lengths are metres, except where a px of the sensor is meant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from tracking.config import param
from tracking.detect.background_settings import BackgroundSettings


@dataclass(frozen=True)
class StereoConfig(BackgroundSettings):
    """The parameters of the tracker `stereo`, with those of the background model.

    Raises InputError if a value is not allowed.
    """

    tracker: ClassVar[str] = "stereo"

    # fmt: off
    nearest: float = param(2.5, (0.5, 20.0), "m",
        "from pixels: depth of the nearest people, which sets the largest disparity", "log", sees="pixels")
    window_time: float = param(0.33, (0.05, 2.0), "s",
        "time window: features that lived shorter are not used; their velocity is the slope in it")
    disparity_noise: float = param(0.15, (0.02, 2.0), "px",
        "from pixels: standard deviation of a feature's disparity", "log", sees="pixels")
    pixel_noise: float = param(0.3, (0.02, 3.0), "px",
        "from pixels: standard deviation of a feature's u and v", "log", sees="pixels")
    surface_offset: float = param(0.12, (0.0, 0.4), "m",
        "from pixels: people's middle lies so far behind their visible surface (ours)", sees="pixels")
    top_offset: float = param(0.65, (0.0, 1.0), "m",
        "from pixels: bodies' middle, as reported, lies so far below the top of the features; 0: mean height (ours)",
        sees="pixels")
    point_noise: float = param(0.06, (0.005, 1.0), "m",
        "from points: standard deviation of a measured coordinate", "log", sees="points")
    gate: float = param(11.34, (5.0, 30.0), "", "gamma: squared Mahalanobis radius of the search region (eq. 8)")
    velocity_weight: float = param(1.0, (0.0, 3.0), "",
        "k_v of eq. 10 as an exponent, beside k_p = 1: as a factor it has no effect (ours)")
    point_covariance: bool = param(True, (True, False), "",
        "points have covariances, in regions, probabilities, hulls and spread (ours)", "categorical")
    person_spread: float = param(0.3, (0.05, 1.0), "m",
        "standard deviation of positions that a group's spread is shrunk to (ours)", "log")
    spread_weight: float = param(10.0, (0.1, 200.0), "points", "weight of this prior, in points (ours)", "log")
    spread_time: float = param(1.0, (0.05, 20.0), "s", "time constant of the spread, alpha_s of eq. 7", "log")
    accel_noise: float = param(0.5, (0.05, 5.0), "m/s^1.5",
        "process noise: square root of the spectral density of a white acceleration (eq. 2)", "log")
    centroid_noise: float = param(0.1, (0.005, 1.0), "m",
        "v of eq. 5: measurement noise of a group's mean beside that of its points, as points come and go", "log")
    density_width: float = param(0.15, (0.05, 20.0), "m",
        "from pixels: kernel of the density by whose inverse features count in the mean (ours)", "log", sees="pixels")
    radius: float = param(0.5, (0.1, 2.0), "m",
        "from pixels: radius of a feature's sphere; features 2 r apart are linked (eq. 12)", sees="pixels")
    point_radius: float = param(0.75, (0.1, 2.0), "m",
        "from points: radius of a point's sphere; points 2 r apart are linked (eq. 12)", sees="points")
    group_points: int = param(5, (1, 50), "points",
        "from pixels: least number of linked features that form a group (sec. 3.4)", "int", sees="pixels")
    merge_gate: float = param(9.0, (0.5, 30.0), "",
        "squared Mahalanobis radius of the six-dimensional regions of merging (eq. 13)")
    split_time: float = param(0.5, (0.0, 100.0), "s",
        "time for which a group's points must be unlinked parts before it splits (ours)", tunable=False)
    confirm_time: float = param(0.3, (0.0, 3.0), "s",
        "a new group is confirmed after so long with measurements, and deleted after so long without (ours)")
    coast_time: float = param(1.5, (0.0, 10.0), "s",
        "a confirmed group is deleted after so long without measurements (ours)")
    # fmt: on
