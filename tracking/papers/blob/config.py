"""The parameters of `blob`, and its nominal filter at a frame rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tracking.config import param
from tracking.detect.background_settings import BackgroundSettings
from tracking.filters.track_uncertainty import Dynamics, check_birth

SIZE_RATE_PRIOR = 0.2  # m/s: standard deviation of the rate of a new track's height and width.
CONFIRM_GATE = 0.99  # Share of a track's own measurements that the gate of the confirming measurement holds.


@dataclass(frozen=True)
class BlobConfig(BackgroundSettings):
    """The parameters of the tracker `blob`, with those of the background model; lengths are metres at the person.

    Raises InputError if a value is not allowed.
    """

    tracker: ClassVar[str] = "blob"

    # fmt: off
    accel_noise: float = param(0.5, (0.05, 10.0), "m/s^1.5",
        "white acceleration of the centre: root of its spectral density", "log")
    size_accel_noise: float = param(0.1, (0.01, 5.0), "m/s^1.5",
        "white acceleration of height and width: root of its spectral density", "log")
    position_noise: float = param(0.09, (0.005, 1.0), "m", "standard deviation of a measured centre", "log")
    size_noise: float = param(0.2, (0.005, 1.0), "m", "standard deviation of a measured height or width", "log")
    speed_prior: float = param(1.3, (0.1, 5.0), "m/s", "standard deviation of a new track's velocity, per axis", "log")
    gate: float = param(0.999, (0.5, 0.999999), "probability",
        "share of a track's own measurements that its gate holds")
    association: str = param("optimal", ("nearest", "optimal"), "",
        "nearest: each measurement to its nearest gated track (the paper); optimal: least cost (ours)", "categorical")
    orphan_gate: float = param(0.9, (0.01, 0.999999), "probability",
        "as `gate`, of a track that is measured: an unassociated box inside this gate starts no track (ours)")
    confirm_ratio: float = param(1.5, (1.01, 2.0), "", "a track is confirmed at or below this value of rho")
    coast_time: float = param(1.5, (0.0, 10.0), "s",
        "a confirmed track is deleted after this time without measurement, from the steady state")
    tentative_time: float = param(1.0, (0.1, 10.0), "s",
        "a tentative track is deleted at this age, but not before it can be confirmed")
    merged_time: float = param(3.0, (0.0, 20.0), "s",
        "coast_time, if longer, of a track hidden or merged with others in one box; 0: no merged boxes (ours)")
    score_start: float = param(0.5, (0.0, 1.0), "score", "least score of a detection that starts a track")
    score_continue: float = param(0.1, (0.0, 1.0), "score", "least score of a detection that updates a track (ours)")
    report_delay: float = param(0.1, (0.0, 5.0), "s",
        "a tentative track is reported from this age on, in frames in which it is measured (ours)")
    report_coast: float = param(0.6, (0.0, 10.0), "s",
        "a confirmed track is reported for this time after its last measurement, from the steady state (ours)")
    report_hidden: float = param(0.7, (0.0, 10.0), "s",
        "replaces report_coast, if longer, for a track that is hidden or merged with others in one box (ours)")
    report_credit: float = param(0.33, (0.0, 10.0), "",
        "a missed track is reported for at most this share of the time in which it was measured (ours)")
    split: bool = param(True, (True, False), "",
        "from pixels: people who share a blob are separated by templates (ours)", "categorical", sees="pixels")
    # fmt: on

    def dynamics(self, fps: float) -> Dynamics:
        """Returns the nominal filter of x, y, h, w (centre, height, width; m) at `fps` frames per s."""
        # Acceleration noises are roots of spectral densities, so that a step has sigma = noise / sqrt(dt) (ours).
        root = np.sqrt(fps)
        accel, size = self.accel_noise * root, self.size_accel_noise * root
        made = Dynamics(
            1.0 / fps,
            np.array([accel, accel, size, size]),
            np.square([self.position_noise, self.position_noise, self.size_noise, self.size_noise]),
            np.square([self.speed_prior, self.speed_prior, SIZE_RATE_PRIOR, SIZE_RATE_PRIOR]),
        )
        if made.dt <= self.tentative_time:  # else a new track has its first measurement only to be confirmed by
            check_birth(made, self.confirm_ratio)
        return made
